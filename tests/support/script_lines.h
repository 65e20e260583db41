// script_lines.h: statements of a contact script, given as text, played in a test.
#pragma once

#include "check.h"

#include "player.h"

// Play text, line by line, up to the first refusal, which names the script "t.script". Its first
// line may be the version. `observer` may be NULL.
pliant_status check_play(pliant_player *player, const pliant_observer *observer, pliant_error *err,
                         const char *text);
// The same for text that is made and must be played whole.
__attribute__((format(printf, 2, 3))) void check_play_ok(pliant_player *player, const char *format,
                                                         ...);
// The text is refused in one line that says where ("t.script:LINE:") and contains `part`.
void check_play_refused(pliant_player *player, const char *text, const char *part);

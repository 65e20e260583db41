// model_files.h: two model files held against each other.
#pragma once

// The same sections with the same bytes; the provenance but for times and the command line. With a
// tolerance: floats that near, relative to the largest of the section, and the provenance is not
// read.
void check_same_model(const char *found, const char *expected, double tolerance);

// test_crc32c.c: CRC-32C against the vectors of RFC 3720 and against itself.
#include "check.h"

#include "crc32c.h"

#include <string.h>

// RFC 3720, B.4: the bytes appear there least significant first.
static void vectors_of_rfc_3720_are_met(void **state)
{
    (void)state;
    unsigned char bytes[32];
    const unsigned char command[48] = {
        0x01, 0xc0, 0, 0, 0, 0, 0, 0, 0, 0, 0,    0, 0, 0, 0, 0, 0x14, 0, 0, 0, 0, 0, 0x04, 0,
        0,    0,    0, 0x14, 0, 0, 0, 0x18, 0x28, 0, 0, 0, 0, 0, 0, 0, 0x02, 0, 0, 0, 0, 0, 0, 0};
    const struct {
        const char *name;
        uint32_t expected;
    } cases[] = {{"zeros", 0x8a9136aa}, {"ones", 0x62a8ab43}, {"up", 0x46dd794e}, {"down", 0x113fdb5c}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        for (int i = 0; i < 32; i++)
            bytes[i] = (unsigned char)(k == 0 ? 0 : k == 1 ? 0xff : k == 2 ? i : 31 - i);
        assert_int_equal(pliant_crc32c(0, bytes, sizeof bytes), cases[k].expected);
        assert_int_equal(pliant_crc32c_portable(0, bytes, sizeof bytes), cases[k].expected);
    }
    assert_int_equal(pliant_crc32c(0, command, sizeof command), 0xd9963a56);
    assert_int_equal(pliant_crc32c_portable(0, command, sizeof command), 0xd9963a56);
    assert_int_equal(pliant_crc32c(0, "123456789", 9), 0xe3069283);  // the catalogue's check value
    assert_int_equal(pliant_crc32c(0, "", 0), 0);
}

static void instruction_and_tables_agree_at_every_length_and_alignment(void **state)
{
    (void)state;
    static unsigned char bytes[5000];
    check_random random = check_random_seed(7);
    for (size_t i = 0; i < sizeof bytes; i++) bytes[i] = (unsigned char)(256 * check_random_next(&random));
    for (size_t offset = 0; offset < 9; offset++)
        for (size_t size = 0; size + offset <= sizeof bytes; size += size < 1100 ? 1 : 97)
            assert_int_equal(pliant_crc32c(5, bytes + offset, size),
                             pliant_crc32c_portable(5, bytes + offset, size));
}

static void checksum_of_two_parts_is_that_of_the_whole(void **state)
{
    (void)state;
    unsigned char bytes[1500];
    for (size_t i = 0; i < sizeof bytes; i++) bytes[i] = (unsigned char)(i * i);
    const uint32_t whole = pliant_crc32c(0, bytes, sizeof bytes);
    for (size_t cut = 0; cut <= sizeof bytes; cut += 13)
        assert_int_equal(pliant_crc32c(pliant_crc32c(0, bytes, cut), bytes + cut, sizeof bytes - cut), whole);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(vectors_of_rfc_3720_are_met),
        cmocka_unit_test(instruction_and_tables_agree_at_every_length_and_alignment),
        cmocka_unit_test(checksum_of_two_parts_is_that_of_the_whole),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

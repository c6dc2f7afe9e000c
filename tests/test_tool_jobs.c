/* Fingerprints, shards and the times of samples: against other ways to say the same. */
#define _GNU_SOURCE
#include "fingerprint.h"
#include "jobs.h"
#include "shutter.h"
#include "unit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static const char *text_of(const nb_fingerprint *print)
{
    static char text[NB_FINGERPRINT_TEXT];
    nb_fingerprint_write(print, text);
    return text;
}

/* By integers of any size in Python: h = (h ^ byte) * (2^88 + 0x13b) mod 2^128; the first three are in
 * draft-eastlake-fnv as well. */
static void test_fingerprints_are_those_of_fnv(void **state)
{
    (void)state;
    nb_fingerprint print = nb_fingerprint_start();
    assert_string_equal(text_of(&print), "6c62272e07bb014262b821756295c58d");
    nb_fingerprint_add(&print, "a", 1);
    assert_string_equal(text_of(&print), "d228cb696f1a8caf78912b704e4a8964");
    print = nb_fingerprint_start();
    nb_fingerprint_add(&print, "foo", 3);
    nb_fingerprint_add(&print, "bar", 3);
    assert_string_equal(text_of(&print), "343e1662793c64bf6f0d3597ba446f18");
    unsigned char bytes[768];
    for (size_t i = 0; i < sizeof bytes; i++) bytes[i] = (unsigned char)i;
    print = nb_fingerprint_start();
    nb_fingerprint_add(&print, bytes, sizeof bytes);
    assert_string_equal(text_of(&print), "ceced98447397784e46346c4dbaac68d");
}

/* By integers in Python as well: h = (h ^ word) * (2^88 + 0x13b) mod 2^128 for each eight bytes, the last five bytes and the size as
 * bytes. */
static void test_files_are_their_bytes_and_their_size(void **state)
{
    char path[] = "/tmp/nebel_fingerprint_XXXXXX";
    static unsigned char bytes[700005]; /* more than is read at once */
    (void)state;
    for (size_t i = 0; i < sizeof bytes; i++) bytes[i] = (unsigned char)(i * 7 + i / 256);
    FILE *file = fdopen(mkstemp(path), "wb");
    assert_int_equal(fwrite(bytes, 1, sizeof bytes, file), sizeof bytes);
    assert_int_equal(fclose(file), 0);
    nb_fingerprint of_file = nb_fingerprint_start();
    assert_int_equal(nb_fingerprint_add_file(&of_file, path), 0);
    assert_string_equal(text_of(&of_file), "5ec232362c310b645b6e260fd281ef84");
    assert_int_equal(remove(path), 0);
    assert_int_not_equal(nb_fingerprint_add_file(&of_file, path), 0);
    assert_int_not_equal(nb_fingerprint_add_file(&of_file, "/tmp"), 0);
    assert_int_not_equal(nb_fingerprint_add_file(&of_file, "/dev/zero"), 0);
}

/* Every item belongs to one shard, and the last of a group's that a shard has tells it. */
static void test_shards_share_all_items(void **state)
{
    (void)state;
    for (uint64_t count = 0; count < 30; count++)
        for (uint64_t group = 1; group < 6; group++)
            for (uint32_t shards = 1; shards < 8; shards++) {
                unsigned char taken[30] = {0};
                for (uint32_t k = 0; k < shards; k++) {
                    nb_jobs jobs = nb_jobs_of(&(nb_shard){k, shards});
                    uint64_t item;
                    assert_int_equal(nb_jobs_begin(&jobs, count, group, 0, ""), 0);
                    while (nb_jobs_take(&jobs, &item)) {
                        assert_int_equal(item % shards, k);
                        taken[item]++;
                        const uint64_t next = item + shards;
                        const int is_last = next >= count || next / group != item / group;
                        assert_int_equal(nb_jobs_finish(&jobs, item, 0), is_last);
                    }
                    assert_int_equal(nb_jobs_end(&jobs, 0), 0);
                }
                for (uint64_t i = 0; i < count; i++) assert_int_equal(taken[i], 1);
            }
}

/* What was there already is no work: neither done nor left. */
static void test_progress_counts_what_there_was_to_do(void **state)
{
    (void)state;
    nb_jobs jobs = nb_jobs_of(&(nb_shard){1, 2});
    uint64_t item, done, all;
    assert_int_equal(nb_jobs_begin(&jobs, 20, 1, 0, ""), 0);
    for (int i = 0; i < 6; i++) {
        assert_true(nb_jobs_take(&jobs, &item));
        (void)nb_jobs_finish(&jobs, item, i < 4);
    }
    assert_true(fabs(nb_jobs_share(&jobs, 0.5, &done, &all) - 2.5 / 6) < 1e-12);
    assert_int_equal(done, 2);
    assert_int_equal(all, 6);
}

static int is_third(void *user, uint64_t item)
{
    *(uint64_t *)user += 1;
    return item % 3 == 0;
}

static int is_late(void *user, uint64_t item)
{
    *(uint64_t *)user += 1;
    return item >= 40;
}

/* What will be found there later is no work, unless what was found so far was no good. */
static void test_progress_counts_what_is_there_ahead(void **state)
{
    (void)state;
    nb_jobs_is_there_fn *const finds[] = {is_third, is_late};
    for (int k = 0; k < 2; k++)
        for (int is_good = 0; is_good < 2; is_good++) {
            nb_jobs jobs = nb_jobs_of(&(nb_shard){0});
            uint64_t item, done, all, asked = 0;
            nb_jobs_survey(&jobs, 120, finds[k], &asked);
            assert_int_equal(asked, 120);
            assert_int_equal(nb_jobs_begin(&jobs, 120, 1, 0, ""), 0);
            (void)nb_jobs_share(&jobs, 0, &done, &all);
            assert_int_equal(all, k == 0 ? 80 : 40);
            while (nb_jobs_take(&jobs, &item)) {
                const int is_there = finds[k](&asked, item);
                if (is_there && !is_good) nb_jobs_note_replaced(&jobs);
                (void)nb_jobs_finish(&jobs, item, is_there && is_good);
                (void)nb_jobs_share(&jobs, 0, &done, &all);
                const int is_known = is_good || k == 0 || item >= 40;
                if (is_known) assert_int_equal(all, !is_good ? 120 : k == 0 ? 80 : 40);
            }
            assert_int_equal(done, all);
        }
    nb_jobs shard = nb_jobs_of(&(nb_shard){1, 3});
    uint64_t asked = 0, done, all;
    nb_jobs_survey(&shard, 120, is_late, &asked);
    assert_int_equal(asked, 40);
    assert_int_equal(nb_jobs_begin(&shard, 120, 1, 0, ""), 0);
    (void)nb_jobs_share(&shard, 0, &done, &all);
    assert_int_equal(all, 13); /* 1, 4 ... 37 */
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* One sample in each of `count` equal parts of the span; and hardly any tie to the sample's number, which is its
 * place in the pixel. */
static void test_times_divide_the_span(void **state)
{
    (void)state;
    for (uint32_t count = 1; count <= 130; count++) {
        double times[130], tie = 0;
        for (uint32_t i = 0; i < count; i++) {
            times[i] = nb_shutter_time(i, count);
            tie += (times[i] - 0.5) * ((i + 0.5) / count - 0.5) * 12 / count;
        }
        if (count >= 9) assert_true(fabs(tie) < 0.31);
        if (count == 16 || count == 32 || count == 64) assert_true(fabs(tie) < 0.06);
        qsort(times, count, sizeof *times, compare_doubles);
        for (uint32_t i = 0; i < count; i++) assert_true(fabs(times[i] - (i + 0.5) / count) < 1e-12);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fingerprints_are_those_of_fnv),
        cmocka_unit_test(test_files_are_their_bytes_and_their_size),
        cmocka_unit_test(test_shards_share_all_items),
        cmocka_unit_test(test_progress_counts_what_there_was_to_do),
        cmocka_unit_test(test_progress_counts_what_is_there_ahead),
        cmocka_unit_test(test_times_divide_the_span),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

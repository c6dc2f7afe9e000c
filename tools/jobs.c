#include "jobs.h"

#include "decimal.h"
#include "ranks.h"
#include "messages.h"
#include "output_check.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Of shards: as many as frames. */
enum { MOST_SHARDS = 1000000 };

nb_shard nb_jobs_read_shard(nb_arguments *arguments, int option)
{
    const char *const text = arguments->values[option];
    nb_shard shard = {0};
    if (text == NULL) return shard;
    const char *const slash = strchr(text, '/');
    const int good = slash != NULL &&
                     nb_decimal_read_whole(text, (size_t)(slash - text), &shard.number) == NB_DECIMAL_GOOD &&
                     nb_decimal_read_whole(slash + 1, strlen(slash + 1), &shard.count) == NB_DECIMAL_GOOD &&
                     shard.count >= 1 && shard.count <= MOST_SHARDS;
    if (!good)
        nb_options_reject(arguments, option, "is no shard such as 0/10, the first of ten, of at most 1000000");
    else if (shard.number >= shard.count)
        nb_options_reject(arguments, option, "is no shard: the first of N is 0/N, the last one is N-1/N");
    return shard;
}

void nb_jobs_refuse_special(nb_arguments *arguments, const int *options, size_t option_count, const char *output)
{
    for (size_t i = 0; i < option_count; i++)
        if (arguments->values[options[i]] != NULL && output != NULL && nb_target_is_special(output))
            nb_options_refuse(arguments, options[i], "is for pictures in files; leave it out, or name a file");
}

nb_jobs nb_jobs_of(const nb_shard *shard)
{
    return (nb_jobs){.shard = *shard, .is_chief = 1};
}

int nb_jobs_join(nb_jobs *jobs)
{
    if (jobs->shard.count > 0 || !nb_ranks_are_launched()) return NB_DONE;
    const int status = nb_ranks_begin();
    jobs->is_joined = status == NB_DONE;
    jobs->is_chief = !jobs->is_joined || nb_ranks_own() == 0;
    return status;
}

int nb_jobs_copy_first(const nb_jobs *jobs, int status, char **bytes, size_t *size)
{
    if (!jobs->is_joined) return status;
    const int worst = nb_ranks_agree(status, "");
    if (worst != NB_DONE) return worst;
    uint64_t length = *size;
    nb_ranks_copy_first(&length, sizeof length);
    if (!jobs->is_chief) *bytes = malloc((size_t)length + 1);
    *size = (size_t)length;
    const int has_room = nb_ranks_agree(*bytes != NULL ? NB_DONE : nb_report_failure("out of memory"), "");
    if (has_room == NB_DONE) nb_ranks_copy_first(*bytes, *size);
    return has_room;
}

int nb_jobs_are_shared(const nb_jobs *jobs)
{
    return jobs->is_joined || jobs->shard.count > 0;
}

int nb_jobs_begin(nb_jobs *jobs, uint64_t count, uint64_t group, int status, const char *same)
{
    jobs->count = count;
    jobs->group = group;
    jobs->next = jobs->shard.number;
    const int worst = jobs->is_joined ? nb_ranks_agree(status, same) : status;
    jobs->has_begun = worst == NB_DONE;
    if (jobs->has_begun && jobs->is_joined) nb_ranks_open_counters(NB_RANKS_FIRST_GROUP + (count + group - 1) / group);
    return worst;
}

void nb_jobs_note_copies(const nb_jobs *jobs)
{
    const char *const tasks = getenv("SLURM_STEP_NUM_TASKS");
    uint32_t count;
    if (nb_jobs_are_shared(jobs) || jobs->count < 2 || tasks == NULL ||
        nb_decimal_read_whole(tasks, strlen(tasks), &count) != NB_DECIMAL_GOOD || count < 2)
        return;
    nb_report_message(
        "note: srun started %u processes, and each does all of the work; share it with srun --mpi=pmix, or with "
        "--shard $SLURM_PROCID/$SLURM_NTASKS",
        (unsigned)count);
}

static uint64_t step_of(const nb_jobs *jobs)
{
    return jobs->shard.count > 0 ? jobs->shard.count : 1;
}

int nb_jobs_take(nb_jobs *jobs, uint64_t *item)
{
    *item = jobs->is_joined ? nb_ranks_add(NB_RANKS_NEXT, 1) : jobs->next;
    if (*item >= jobs->count) return 0;
    jobs->next = *item + step_of(jobs);
    return 1;
}

int nb_jobs_finish(nb_jobs *jobs, uint64_t item, int is_kept)
{
    const uint64_t group = item / jobs->group, first = group * jobs->group;
    const uint64_t size = jobs->count - first < jobs->group ? jobs->count - first : jobs->group;
    *(is_kept ? &jobs->kept : &jobs->made) += 1;
    if (!jobs->is_joined) return jobs->next >= first + size;
    (void)nb_ranks_add(is_kept ? NB_RANKS_KEPT : NB_RANKS_MADE, 1);
    return nb_ranks_add(NB_RANKS_FIRST_GROUP + group, 1) + 1 == size;
}

void nb_jobs_note_replaced(nb_jobs *jobs)
{
    jobs->replaced++;
    if (jobs->is_joined) (void)nb_ranks_add(NB_RANKS_REPLACED, 1);
}

void nb_jobs_fail(nb_jobs *jobs)
{
    jobs->failed++;
    if (jobs->is_joined) (void)nb_ranks_add(NB_RANKS_FAILED, 1);
}

void nb_jobs_answer(const nb_jobs *jobs)
{
    if (jobs->is_joined) nb_ranks_answer();
}

static void sum_up(nb_jobs *jobs)
{
    jobs->all_made = jobs->is_joined ? nb_ranks_add(NB_RANKS_MADE, 0) : jobs->made;
    jobs->all_replaced = jobs->is_joined ? nb_ranks_add(NB_RANKS_REPLACED, 0) : jobs->replaced;
    jobs->all_kept = jobs->is_joined ? nb_ranks_add(NB_RANKS_KEPT, 0) : jobs->kept;
    jobs->all_failed = jobs->is_joined ? nb_ranks_add(NB_RANKS_FAILED, 0) : jobs->failed;
}

static uint64_t count_own(const nb_jobs *jobs)
{
    const uint64_t step = step_of(jobs);
    return jobs->count > jobs->shard.number ? (jobs->count - jobs->shard.number + step - 1) / step : 0;
}

uint64_t nb_jobs_even_share(const nb_jobs *jobs)
{
    const uint64_t processes = jobs->is_joined ? (uint64_t)nb_ranks_count() : 1;
    return (count_own(jobs) + processes - 1) / processes;
}

void nb_jobs_survey(nb_jobs *jobs, uint64_t count, nb_jobs_is_there_fn *is_there, void *user)
{
    jobs->found = 0;
    for (uint64_t item = jobs->shard.number; item < count; item += step_of(jobs))
        jobs->found += is_there(user, item) != 0;
}

/* How many of the items that are not reached yet will be kept. */
static uint64_t expect_kept(const nb_jobs *jobs, uint64_t count)
{
    const uint64_t judged = jobs->all_kept + jobs->all_replaced,
                   seen = jobs->all_made + jobs->all_kept + jobs->all_failed;
    if (jobs->found <= judged || seen >= count) return 0;
    const uint64_t found = jobs->found - judged, left = count - seen;
    const double good = judged > 0 ? (double)jobs->all_kept / (double)judged : 1;
    const uint64_t kept = (uint64_t)(good * (double)found + 0.5);
    return kept < left ? kept : left;
}

double nb_jobs_share(nb_jobs *jobs, double of_item, uint64_t *done, uint64_t *all)
{
    sum_up(jobs);
    const uint64_t count = jobs->is_joined ? jobs->count : count_own(jobs);
    *done = jobs->all_made + jobs->all_failed;
    *all = count - jobs->all_kept - expect_kept(jobs, count);
    return *all > 0 ? ((double)*done + of_item) / (double)*all : 1;
}

void nb_jobs_show(nb_jobs *jobs, nb_progress_bar *meter, const char *what, double of_item)
{
    uint64_t done, count;
    const double share = nb_jobs_share(jobs, of_item, &done, &count);
    char label[64] = "";
    if (count > 1)
        (void)snprintf(label, sizeof label, "%s %llu of %llu", what,
                       (unsigned long long)(done < count ? done + 1 : count), (unsigned long long)count);
    nb_progress_bar_show(meter, share, label);
}

int nb_jobs_end(nb_jobs *jobs, int status)
{
    if (!jobs->is_joined) {
        sum_up(jobs);
        return status;
    }
    const int worst = nb_ranks_agree(status, "");
    if (jobs->has_begun) sum_up(jobs);
    nb_ranks_sum(jobs->sums, NB_JOBS_SUMS);
    nb_ranks_end();
    jobs->is_joined = 0;
    return worst;
}

void nb_jobs_describe(const nb_jobs *jobs, const char *what, char *text, size_t size)
{
    const unsigned long long kept = jobs->all_kept, count = jobs->all_made + kept, failed = jobs->all_failed;
    char there[48] = "", lost[48] = "";
    if (kept > 0) (void)snprintf(there, sizeof there, ", %llu of them there already", kept);
    if (failed > 0) (void)snprintf(lost, sizeof lost, ", %llu failed", failed);
    (void)snprintf(text, size, "%llu %s%s%s%s", count, what, count == 1 ? "" : "s", there, lost);
}

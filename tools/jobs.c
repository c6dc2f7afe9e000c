#include "jobs.h"

#include "decimal.h"
#include "ranks.h"
#include "report.h"

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

int nb_jobs_are_shared(const nb_jobs *jobs)
{
    return jobs->is_joined || jobs->shard.count > 0;
}

int nb_jobs_begin(nb_jobs *jobs, uint64_t count, uint64_t group, int status, const char *same)
{
    jobs->count = count;
    jobs->group = group;
    jobs->next = jobs->shard.number;
    if (!jobs->is_joined) return status;
    const int worst = nb_ranks_agree(status, same);
    if (worst == NB_DONE) nb_ranks_open_counters(NB_RANKS_FIRST_GROUP + (count + group - 1) / group);
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

void nb_jobs_answer(const nb_jobs *jobs)
{
    if (jobs->is_joined) nb_ranks_answer();
}

static void sum_up(nb_jobs *jobs)
{
    jobs->all_made = jobs->is_joined ? nb_ranks_add(NB_RANKS_MADE, 0) : jobs->made;
    jobs->all_kept = jobs->is_joined ? nb_ranks_add(NB_RANKS_KEPT, 0) : jobs->kept;
}

static uint64_t count_own(const nb_jobs *jobs)
{
    const uint64_t step = step_of(jobs);
    return jobs->count > jobs->shard.number ? (jobs->count - jobs->shard.number + step - 1) / step : 0;
}

double nb_jobs_share(nb_jobs *jobs, double of_item, uint64_t *done, uint64_t *all)
{
    sum_up(jobs);
    const uint64_t count = jobs->is_joined ? jobs->count : count_own(jobs);
    *done = jobs->all_made;
    *all = count - jobs->all_kept;
    return *all > 0 ? ((double)*done + of_item) / (double)*all : 1;
}

int nb_jobs_end(nb_jobs *jobs, int status)
{
    if (!jobs->is_joined) {
        sum_up(jobs);
        return status;
    }
    const int worst = nb_ranks_agree(status, "");
    if (worst == NB_DONE) sum_up(jobs);
    nb_ranks_end();
    jobs->is_joined = 0;
    return worst;
}

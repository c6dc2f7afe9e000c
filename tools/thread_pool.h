/* Work on several processors. */
#ifndef NB_TOOLS_THREAD_POOL_H
#define NB_TOOLS_THREAD_POOL_H

/* One share of the work: `worker` of `count`. Every share is done once, by any thread. */
typedef void (*nb_workers_fn)(int worker, int count, void *user);

enum { NB_MAX_WORKERS = 1024 };

/* How many threads "all" means here. */
int nb_workers_available(void);

/* Runs the shares 0 .. count - 1 at once and returns when all are done. Where the system gives no thread, the caller's
 * does the share. count: 1 to NB_MAX_WORKERS. */
void nb_workers_run(int count, nb_workers_fn work, void *user);

#endif

#define _GNU_SOURCE
#include "confine.h"

#include <fcntl.h>
#include <sys/syscall.h>
#include <unistd.h>

#if defined(SYS_landlock_create_ruleset)
#include <linux/landlock.h>
#include <sys/prctl.h>
#endif

#if defined(SYS_landlock_create_ruleset)
/* The first version of Landlock (Linux 5.13) knows these. */
static const unsigned long long all_rights =
    LANDLOCK_ACCESS_FS_EXECUTE | LANDLOCK_ACCESS_FS_WRITE_FILE | LANDLOCK_ACCESS_FS_READ_FILE |
    LANDLOCK_ACCESS_FS_READ_DIR | LANDLOCK_ACCESS_FS_REMOVE_DIR | LANDLOCK_ACCESS_FS_REMOVE_FILE |
    LANDLOCK_ACCESS_FS_MAKE_CHAR | LANDLOCK_ACCESS_FS_MAKE_DIR | LANDLOCK_ACCESS_FS_MAKE_REG |
    LANDLOCK_ACCESS_FS_MAKE_SOCK | LANDLOCK_ACCESS_FS_MAKE_FIFO | LANDLOCK_ACCESS_FS_MAKE_BLOCK |
    LANDLOCK_ACCESS_FS_MAKE_SYM;

static void allow(int rules, const char *path, unsigned long long rights)
{
    const int place = open(path, O_PATH | O_CLOEXEC);
    const struct landlock_path_beneath_attr rule = {.allowed_access = rights, .parent_fd = place};
    if (place < 0) return;
    syscall(SYS_landlock_add_rule, rules, LANDLOCK_RULE_PATH_BENEATH, &rule, 0);
    close(place);
}

void nb_confine_files(const char *file, const char *folder)
{
    const struct landlock_ruleset_attr handled = {.handled_access_fs = all_rights};
    if (NB_SANITIZED) return; /* their reports read files */
    const int rules = (int)syscall(SYS_landlock_create_ruleset, &handled, sizeof handled, 0);
    if (rules < 0) return;
    allow(rules, file, LANDLOCK_ACCESS_FS_READ_FILE);
    allow(rules, folder[0] != '\0' ? folder : ".", LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR);
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0) syscall(SYS_landlock_restrict_self, rules, 0);
    close(rules);
}
#else
void nb_confine_files(const char *file, const char *folder)
{
    (void)file, (void)folder;
}
#endif

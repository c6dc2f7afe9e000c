#include "path.h"

#include <string.h>

const char *nb_path_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash != NULL ? slash + 1 : path;
}

const char *nb_path_folder(nb_arena *arena, const char *path)
{
    return nb_arena_copy_text(arena, path, (size_t)(nb_path_name(path) - path));
}

const char *nb_path_join(nb_arena *arena, const char *folder, const char *path)
{
    const size_t folder_size = path[0] == '/' ? 0 : strlen(folder), size = strlen(path);
    char *joined = nb_arena_allocate(arena, folder_size + size + 1, 1);
    if (joined == NULL) return NULL;
    memcpy(joined, folder, folder_size);
    memcpy(joined + folder_size, path, size);
    return joined;
}

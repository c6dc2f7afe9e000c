/* Reads scenes from standard input, each a name and a text that end in zero bytes, and writes a line for each: "good",
 * or what the reader says. For checks that try thousands of scenes. */
#include <nebel/scene.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void say(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level, (void)result;
    (void)user;
    printf("%s\n", message);
}

/* All of standard input, with a zero byte behind it. */
static char *read_input(size_t *size)
{
    size_t room = (size_t)1 << 20;
    char *text = malloc(room);
    *size = 0;
    while (text != NULL) {
        *size += fread(text + *size, 1, room - *size - 1, stdin);
        if (feof(stdin) || ferror(stdin)) break;
        char *grown = realloc(text, room *= 2);
        if (grown == NULL) free(text);
        text = grown;
    }
    if (text != NULL) text[*size] = '\0';
    return text;
}

int main(void)
{
    size_t size;
    char *input = read_input(&size);
    if (input == NULL) return 1;
    for (const char *at = input; at < input + size;) {
        const char *name = at, *text = name + strlen(name) + 1;
        nebel_scene *scene = NULL;
        const nebel_scene_desc desc = {.host.log = {say, NULL}, .memory = (uint64_t)1 << 50}; /* limits one by one */
        if (text >= input + size) return 1;
        if (nebel_parse_scene(text, strlen(text), name, &desc, &scene) == NEBEL_OK) printf("good\n");
        nebel_destroy_scene(scene);
        at = text + strlen(text) + 1;
    }
    free(input);
    return 0;
}

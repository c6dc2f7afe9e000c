/* What is wrong with a text that yajl refuses, said so that it can be mended. */
#ifndef NB_JSON_JSON_SYNTAX_H
#define NB_JSON_JSON_SYNTAX_H

#include "json.h"

/* The first byte at or after `at` that is neither blank nor comment. Within a comment that never ends: size + 1, and
 * *comment (where not NULL) says where it begins. */
size_t nb_json_skip_blanks(const nb_json *json, size_t at, size_t *comment);

/* Fails the reading of a text that cannot be JSON at all: of another encoding, with control characters, empty. True
 * where there is something to parse. */
bool nb_json_check_text(nb_json *json);

/* Fails the reading with what is wrong behind `end`, the end of the last token that yajl took: it knows that a text is
 * wrong, but not what its writer meant. */
void nb_json_explain(nb_json *json, size_t end);

/* Whether nothing stands right behind a number that looks like a part of it: a unit, or digits of another base. */
bool nb_json_check_number(nb_json *json, const nb_json_node *number);

#endif

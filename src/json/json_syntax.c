#include "json_syntax.h"
#include "utf8.h"

#include <stdio.h>
#include <string.h>

/* What may stand where the parser stopped. */
typedef enum expectation {
    SCENE,       /* { */
    NOTHING,     /* the scene is complete */
    FIRST_KEY,   /* or } */
    KEY,         /* after a comma */
    COLON,       /* after a key */
    VALUE,       /* after a colon */
    FIRST_VALUE, /* or ] */
    NEXT_VALUE,  /* after a comma */
    SEPARATOR    /* a comma, or the end of what is open */
} expectation;

typedef struct nb_syntax_spot {
    nb_json *json;
    const char *text;
    size_t size;
    size_t end;   /* of the last good token */
    size_t at;    /* what is wrong; size: the end of the file */
    size_t comma; /* before it, where one must be */
    expectation expected;
    const nb_json_node *about; /* what messages name; NULL: the innermost of what is open */
} nb_syntax_spot;

/* ---- the text -------------------------------------------------------------------------------- */

size_t nb_json_skip_blanks(const nb_json *json, size_t at, size_t *comment)
{
    const char *text = json->desc.text;
    const size_t size = json->desc.size;
    while (at < size) {
        const char next = at + 1 < size ? text[at + 1] : '\0';
        if (memchr(" \t\r\n", text[at], 4) != NULL) {
            at++;
        } else if (text[at] == '/' && next == '/') {
            const char *end = memchr(text + at, '\n', size - at);
            at = end != NULL ? (size_t)(end - text) + 1 : size;
        } else if (text[at] == '/' && next == '*') {
            size_t end = at + 3;
            while (end < size && !(text[end] == '/' && text[end - 1] == '*')) end++;
            if (end >= size && comment != NULL) *comment = at;
            at = end < size ? end + 1 : size + 1;
        } else {
            break;
        }
    }
    return at;
}

static bool is_letter(char c)
{
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

/* Letters and digits, and what else may be in a number or a name. */
static bool is_word(char c)
{
    return is_letter(c) || nb_text_is_digit(c) || (c != '\0' && strchr("_.+-$", c) != NULL);
}

/* The word around or behind a byte, for messages. */
typedef struct word {
    const char *text;
    int size;
} word;

enum { WORD_SHOWN = 40 };

static word word_from(const nb_syntax_spot *wrong, size_t start)
{
    size_t end = start;
    while (end < wrong->size && is_word(wrong->text[end]) && end - start < WORD_SHOWN) end++;
    return (word){wrong->text + start, (int)(end - start)};
}

static bool word_is(word given, const char *const *names, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        if (strlen(names[i]) != (size_t)given.size) continue;
        int same = 0; /* whatever the case of the letters */
        while (same < given.size && (given.text[same] | 0x20) == names[i][same]) same++;
        if (same == given.size) return true;
    }
    return false;
}

#define WORD_IS(given, ...)                                                                                            \
    word_is(given, (const char *const[]){__VA_ARGS__},                                                                 \
            sizeof((const char *const[]){__VA_ARGS__}) / sizeof(const char *))

/* ---- messages -------------------------------------------------------------------------------- */

static const nb_json_node *innermost(const nb_json *json)
{
    return json->depth > 0 ? &json->nodes[json->open[json->depth - 1]] : NULL;
}

static void fail_syntax(const nb_syntax_spot *wrong, size_t at, const char *message)
{
    char path[NB_JSON_PATH] = "";
    const nb_json_node *about = wrong->about != NULL ? wrong->about : innermost(wrong->json);
    if (about != NULL) nb_json_path(wrong->json, about, path);
    nb_json_fail_at(wrong->json, NEBEL_ERROR_FORMAT, at, path, "%s", message);
}

#define FAIL(wrong, at, ...)                                                                                           \
    do {                                                                                                               \
        char message[400];                                                                                             \
        snprintf(message, sizeof message, __VA_ARGS__);                                                                \
        fail_syntax(wrong, at, message);                                                                               \
    } while (0)

/* "the object that began at line 3, column 5" */
static void name_innermost(const nb_syntax_spot *wrong, char name[96])
{
    const nb_json_node *node = innermost(wrong->json);
    const nb_text_place place = nb_json_place(wrong->json, node->offset);
    snprintf(name, 96, "the %s that began at line %zu, column %zu", node->type == NB_JSON_ARRAY ? "array" : "object",
             place.line, place.column);
}

static char closing(const nb_syntax_spot *wrong)
{
    return innermost(wrong->json)->type == NB_JSON_ARRAY ? ']' : '}';
}

static void explain_end(const nb_syntax_spot *wrong)
{
    char open[96];
    name_innermost(wrong, open);
    FAIL(wrong, wrong->size, "the file ends inside %s; is it cut off, or is a %c missing?", open, closing(wrong));
}

/* The wrong one of } and ]. */
static void explain_bracket(const nb_syntax_spot *wrong)
{
    char open[96];
    name_innermost(wrong, open);
    FAIL(wrong, wrong->at, "%c cannot close %s; is a %c missing before it, or is it one too many?",
         wrong->text[wrong->at], open, closing(wrong));
}

/* ---- strings --------------------------------------------------------------------------------- */

static void explain_escape(const nb_syntax_spot *wrong, size_t at)
{
    if (wrong->text[at + 1] == 'u')
        FAIL(wrong, at, "\\u needs four hexadecimal digits behind it, as in \\u00e4");
    else
        FAIL(wrong, at, "this \\ begins no escape that JSON knows; write \\\\ for a backslash, / in a path");
}

static void explain_string(const nb_syntax_spot *wrong)
{
    const char *text = wrong->text;
    size_t at = wrong->at + 1;
    for (; at < wrong->size && text[at] != '"'; at++) {
        if (text[at] == '\n' || text[at] == '\r') break;
        if (text[at] == '\t') {
            FAIL(wrong, at, "a tab inside a string; write \\t or a blank");
            return;
        }
        if (text[at] != '\\') continue;
        if (at + 1 == wrong->size) break;
        if (strchr("\"\\/bfnrt", text[at + 1]) == NULL && !nb_text_is_unicode_escape(text, wrong->size, at)) {
            explain_escape(wrong, at);
            return;
        }
        at++;
    }
    if (at + 1 >= wrong->size)
        FAIL(wrong, wrong->at, "the file ends inside this string; is it cut off, or is a \" missing?");
    else
        FAIL(wrong, wrong->at, "this string has no end on its line; close it with \"");
}

/* UTF-8 of the quotation marks that word processors put in the place of " and '. */
static bool is_curly_quote(const nb_syntax_spot *wrong)
{
    static const char *const quotes[] = {"\xE2\x80\x98", "\xE2\x80\x99", "\xE2\x80\x9C", "\xE2\x80\x9D",
                                         "\xE2\x80\x9E", "\xC2\xAB",     "\xC2\xBB"};
    for (size_t i = 0; i < sizeof quotes / sizeof *quotes; i++) {
        const size_t size = strlen(quotes[i]);
        if (wrong->size - wrong->at >= size && memcmp(wrong->text + wrong->at, quotes[i], size) == 0) return true;
    }
    return false;
}

/* ---- numbers and words ----------------------------------------------------------------------- */

static const char *number_advice(word number)
{
    const char *text = number.text;
    const char *const end = text + number.size;
    if (*text == '+') return "leave out the +";
    if (*text == '-') text++;
    if (text == end) return "a digit must follow the -";
    if (*text == '.') return "write 0 before the point";
    if (end - text > 1 && *text == '0' && nb_text_is_digit(text[1])) return "leave out the 0 in front";
    while (text < end && nb_text_is_digit(*text)) text++;
    if (text < end && *text == '.' && (text + 1 == end || !nb_text_is_digit(text[1])))
        return "leave out the point, or write a digit behind it";
    if (text < end && *text == '.') text++;
    while (text < end && nb_text_is_digit(*text)) text++;
    if (text < end && (*text | 0x20) == 'x') return "numbers are decimal: -0.5, 12, 2e3";
    return text < end && is_letter(*text) ? "write it without a unit: -0.5, 12, 2e3"
                                          : "numbers look like -0.5, 12, 2e3";
}

/* An e behind which there are no digits: the beginning of a number that is not complete. */
static bool lacks_exponent(word number)
{
    const char *const end = number.text + number.size;
    const char *at = end;
    if (at > number.text && strchr("+-", at[-1]) != NULL) at--;
    return at - number.text > 1 && (at[-1] | 0x20) == 'e' && nb_text_is_digit(at[-2]);
}

static void explain_number(const nb_syntax_spot *wrong, size_t start)
{
    const word number = word_from(wrong, start);
    const char *advice = lacks_exponent(number) ? "digits must follow the e, as in 2e3" : number_advice(number);
    FAIL(wrong, start, "%.*s is no number of JSON; %s", number.size, number.text, advice);
}

/* What people write behind a number: a word, a percent or a degree sign, but no key, which has a colon. */
static bool is_unit(const nb_syntax_spot *wrong)
{
    static const char degree[] = "\xC2\xB0";
    const char *text = wrong->text + wrong->at;
    if (wrong->size - wrong->at >= 2 && memcmp(text, degree, 2) == 0) return true;
    if (*text == '%') return true;
    if (!is_word(*text) || nb_text_is_digit(*text) || strchr("+-.", *text) != NULL) return false;
    const size_t end = nb_json_skip_blanks(wrong->json, wrong->at + (size_t)word_from(wrong, wrong->at).size, NULL);
    return end >= wrong->size || wrong->text[end] != ':';
}

static void explain_word(const nb_syntax_spot *wrong, const char *what)
{
    const word given = word_from(wrong, wrong->at);
    const bool is_signed = given.text[0] == '-' || given.text[0] == '+';
    const word name = {given.text + is_signed, given.size - is_signed};
    if (WORD_IS(name, "nan", "inf", "infinity", "1.#inf", "1.#qnan"))
        FAIL(wrong, wrong->at, "JSON has no %.*s; write a finite number such as 0.5 or 2e3, or leave it out",
             given.size, given.text);
    else if (WORD_IS(name, "true", "false", "null"))
        FAIL(wrong, wrong->at, "%.*s is written in small letters", given.size, given.text);
    else if (is_signed || given.text[0] == '.')
        explain_number(wrong, wrong->at);
    else
        FAIL(wrong, wrong->at, "%s stand in double quotes; write \"%.*s\"", what, given.size, given.text);
}

static void explain_unit(const nb_syntax_spot *wrong)
{
    FAIL(wrong, wrong->at, "a number has no unit behind it; remove this");
}

/* A character that begins nothing. */
static void explain_character(const nb_syntax_spot *wrong, const char *wanted)
{
    const size_t length = nb_text_sequence(wrong->text, wrong->size, wrong->at);
    if (wrong->text[wrong->at] == '\'' || wrong->text[wrong->at] == '`' || is_curly_quote(wrong))
        FAIL(wrong, wrong->at, "strings and keys stand in straight double quotes: \"...\"");
    else if (wrong->text[wrong->at] == '#')
        FAIL(wrong, wrong->at, "a comment begins with // here, not with #");
    else if (wrong->text[wrong->at] == '/')
        FAIL(wrong, wrong->at, "a comment begins with // or /*; this is one / alone");
    else
        FAIL(wrong, wrong->at, "found '%.*s'; %s", (int)length, wrong->text + wrong->at, wanted);
}

/* ---- what is wrong, by what was expected ----------------------------------------------------- */

static void explain_scene(const nb_syntax_spot *wrong)
{
    const word found = word_from(wrong, wrong->at);
    if (wrong->text[wrong->at] == '#')
        FAIL(wrong, wrong->at, "found '#'; a scene is an object and begins with {, a comment with //");
    else if (found.size > 0)
        FAIL(wrong, wrong->at, "found '%.*s'; a scene is an object and begins with {", found.size, found.text);
    else
        explain_character(wrong, "a scene is an object and begins with {");
}

static void explain_rest(const nb_syntax_spot *wrong)
{
    const nb_text_place place = nb_json_place(wrong->json, wrong->end - 1);
    if (strchr("#'/`", wrong->text[wrong->at]) != NULL)
        explain_character(wrong, "");
    else
        FAIL(wrong, wrong->at,
             "the scene is complete, its last } is at line %zu, column %zu; remove that } or what follows it",
             place.line, place.column);
}

static void explain_trailing_comma(const nb_syntax_spot *wrong)
{
    FAIL(wrong, wrong->comma, "a comma, and then %c: remove the comma, or write what is missing behind it",
         closing(wrong));
}

static void explain_key(const nb_syntax_spot *wrong)
{
    const char found = wrong->text[wrong->at];
    if (found == '"')
        explain_string(wrong);
    else if (found == '}')
        explain_trailing_comma(wrong);
    else if (found == ']')
        explain_bracket(wrong);
    else if (found == ',')
        FAIL(wrong, wrong->at, "a comma too many; remove it");
    else if (nb_text_is_digit(found) && wrong->expected == KEY)
        FAIL(wrong, wrong->at, "a number, but a key must follow the comma; decimals have a point, 0.5, and lists [ ]");
    else if (is_word(found) && !nb_text_is_digit(found) && strchr("+-.", found) == NULL)
        explain_word(wrong, "keys");
    else
        explain_character(wrong, "a key in double quotes must stand here");
}

/* The key that waits for its value. */
static word pending_key(const nb_syntax_spot *wrong)
{
    const nb_json_node *key = &wrong->json->key;
    size_t size = key->key_size < WORD_SHOWN ? key->key_size : WORD_SHOWN;
    while (size > 0 && size < key->key_size && (key->key[size] & 0xC0) == 0x80) size--;
    return (word){key->key, (int)size};
}

static void explain_colon(const nb_syntax_spot *wrong)
{
    const word key = pending_key(wrong);
    FAIL(wrong, wrong->at, "the key needs a colon and a value: \"%.*s\": ...", key.size, key.text);
}

static void explain_missing_value(const nb_syntax_spot *wrong)
{
    FAIL(wrong, wrong->at, "the key has no value; write one before the %c", wrong->text[wrong->at]);
}

static void explain_wrong_value(const nb_syntax_spot *wrong)
{
    const char found = wrong->text[wrong->at];
    if (found == '"')
        explain_string(wrong);
    else if (found == '}' || found == ']' || found == ',')
        explain_missing_value(wrong);
    else if (nb_text_is_digit(found))
        explain_number(wrong, wrong->at);
    else if (is_word(found))
        explain_word(wrong, "texts");
    else
        explain_character(wrong, "a value must stand here: a number, \"text\", [...] or {...}");
}

static void explain_value(const nb_syntax_spot *wrong)
{
    const char found = wrong->text[wrong->at];
    if (found == ',' && wrong->expected != VALUE) {
        FAIL(wrong, wrong->at, "a comma too many; remove it");
    } else if (found == ']' && wrong->expected == NEXT_VALUE) {
        explain_trailing_comma(wrong);
    } else if ((found == '}' || found == ']') && wrong->expected != VALUE) {
        explain_bracket(wrong);
    } else {
        nb_syntax_spot value = *wrong;
        nb_json_node missing = wrong->json->key; /* without a key in an array */
        missing.parent = wrong->json->open[wrong->json->depth - 1];
        missing.index = innermost(wrong->json)->count;
        value.about = &missing;
        explain_wrong_value(&value);
    }
}

static void explain_separator(const nb_syntax_spot *wrong)
{
    const char found = wrong->text[wrong->at], before = wrong->text[wrong->end - 1];
    if (found == '}' || found == ']') {
        explain_bracket(wrong);
    } else if (wrong->at == wrong->end && before == '"' && is_word(found)) {
        FAIL(wrong, wrong->at, "the string before this ends here; a comma is missing, or write \\\" for a \" in it");
    } else if (nb_text_is_digit(before) && is_unit(wrong)) {
        const nb_json *json = wrong->json;
        const uint32_t last = json->last[json->depth - 1]; /* 0: it was a tree of its own, and lies behind the others */
        nb_syntax_spot number = *wrong;
        number.about = &json->nodes[last != 0 ? last : json->node_count];
        explain_unit(&number);
    } else if (found == ':') {
        FAIL(wrong, wrong->at, "a colon stands between a key and its value only; in { } write \"key\": value");
    } else if (found == '"' || found == '{' || found == '[' || is_word(found)) {
        FAIL(wrong, wrong->at, "a comma is missing before this");
    } else {
        char wanted[64];
        snprintf(wanted, sizeof wanted, "a comma or %c must follow the value", closing(wrong));
        explain_character(wrong, wanted);
    }
}

static bool is_cut_off(const nb_syntax_spot *wrong)
{
    size_t end = wrong->at;
    while (end < wrong->size && is_word(wrong->text[end])) end++;
    return end == wrong->size && wrong->json->depth > 0;
}

static void explain(const nb_syntax_spot *wrong)
{
    switch (wrong->expected) {
    case SCENE:
        explain_scene(wrong);
        return;
    case NOTHING:
        explain_rest(wrong);
        return;
    case FIRST_KEY:
    case KEY:
        explain_key(wrong);
        return;
    case COLON:
        explain_colon(wrong);
        return;
    case VALUE:
    case FIRST_VALUE:
    case NEXT_VALUE:
        explain_value(wrong);
        return;
    case SEPARATOR:
        explain_separator(wrong);
        return;
    }
}

static expectation expect_after_token(const nb_json *json)
{
    if (json->depth == 0) return json->node_count == 0 ? SCENE : NOTHING;
    if (json->key.key != NULL) return COLON;
    if (innermost(json)->count > 0) return SEPARATOR;
    return innermost(json)->type == NB_JSON_ARRAY ? FIRST_VALUE : FIRST_KEY;
}

/* Steps over the comma or colon that is as it should be. */
static bool take_separator(nb_syntax_spot *wrong)
{
    const char found = wrong->at < wrong->size ? wrong->text[wrong->at] : '\0';
    if (wrong->expected == COLON && found == ':') {
        wrong->expected = VALUE;
    } else if (wrong->expected == SEPARATOR && found == ',') {
        wrong->expected = innermost(wrong->json)->type == NB_JSON_ARRAY ? NEXT_VALUE : KEY;
        wrong->comma = wrong->at;
    } else {
        return false;
    }
    return true;
}

bool nb_json_check_number(nb_json *json, const nb_json_node *number)
{
    const size_t at = number->end;
    const nb_syntax_spot wrong = {json, json->desc.text, json->desc.size, at, at, 0, SEPARATOR, number};
    if (at >= json->desc.size || (!is_word(json->desc.text[at]) && !is_unit(&wrong)) || is_cut_off(&wrong)) return true;
    if (is_word(json->desc.text[at]))
        explain_number(&wrong, number->offset);
    else
        explain_unit(&wrong);
    return false;
}

void nb_json_explain(nb_json *json, size_t end)
{
    size_t comment = 0;
    nb_syntax_spot wrong = {json, json->desc.text, json->desc.size, end, 0, 0, expect_after_token(json), NULL};
    wrong.at = nb_json_skip_blanks(json, end, &comment);
    if (take_separator(&wrong)) wrong.at = nb_json_skip_blanks(json, wrong.at + 1, &comment);
    if (wrong.at > wrong.size)
        FAIL(&wrong, comment, "the file ends within this comment; close it with */");
    else if (is_cut_off(&wrong))
        explain_end(&wrong);
    else
        explain(&wrong);
}

/* ---- what is no text ------------------------------------------------------------------------- */

/* Nearly all characters of a scene are ASCII, so that every second byte of UTF-16 is 0. */
static bool is_utf16(const unsigned char *byte, size_t size)
{
    if (size < 2) return false;
    const bool mark = (byte[0] == 0xFF && byte[1] == 0xFE) || (byte[0] == 0xFE && byte[1] == 0xFF);
    return mark || (byte[0] == 0) != (byte[1] == 0);
}

static bool fail_text(nb_json *json, size_t offset, const char *message)
{
    return nb_json_fail_at(json, NEBEL_ERROR_FORMAT, offset, "", "%s", message);
}

bool nb_json_check_text(nb_json *json)
{
    const unsigned char *byte = (const unsigned char *)json->desc.text;
    const size_t size = json->desc.size;
    size_t offset;
    if (size >= 3 && memcmp(byte, "\xEF\xBB\xBF", 3) == 0)
        return fail_text(json, 0, "the file starts with a byte order mark; save it as UTF-8 without one");
    if (is_utf16(byte, size)) return fail_text(json, 0, "the file is UTF-16; save it as UTF-8");
    if (!nb_text_is_clean(json->desc.text, size, &offset)) {
        const size_t start = nb_json_skip_blanks(json, 0, NULL);
        if (start >= size || byte[start] != '{')
            return fail_text(json, offset, "this is no text; a scene is a JSON text, saved as UTF-8");
        const bool control = byte[offset] < 0x20 || byte[offset] == 0x7F;
        return nb_json_fail_at(json, NEBEL_ERROR_FORMAT, offset, "",
                               control ? "the control character 0x%02X is not possible in JSON; remove it"
                                       : "the byte 0x%02X is not UTF-8 here; save the file as UTF-8",
                               byte[offset]);
    }
    size_t comment = 0;
    offset = nb_json_skip_blanks(json, 0, &comment);
    if (offset > size) return fail_text(json, comment, "the file ends within this comment; close it with */");
    return offset < size ||
           fail_text(json, size, "the file is empty; a scene holds at least {\"nebel\": 1, \"fog\": []}");
}

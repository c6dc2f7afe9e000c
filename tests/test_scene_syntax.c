/* What people write that is not JSON, and what they are told. */
#include "scene_help.h"

#define FOG(text) "{\"nebel\": 1, \"fog\": [" text

static void test_commas_and_colons(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, FOG("]`,}"), "a comma, and then }: remove the comma, or write what is missing behind it"},
        {FORMAT, FOG("{\"name\": \"a\"`, // last\n }"), "fog[0]: a comma, and then }"},
        {FORMAT, "{\"background\": [1, 2, 3`,]", "background: a comma, and then ]"},
        {FORMAT, "{\"nebel\": 1, `, \"fog\": []}", "a comma too many; remove it"},
        {FORMAT, "{\"background\": [`, 1]", "background: a comma too many; remove it"},
        {FORMAT, "{`,}", "a comma too many; remove it"},
        {FORMAT, "{\"nebel\": 1\n `\"fog\": []}", "a comma is missing before this"},
        {FORMAT, "{\"background\": [1 `2, 3]", "background: a comma is missing before this"},
        {FORMAT, FOG("{\"name\": \"a\" `\"shape\": 1}]}"), "fog[0]: a comma is missing before this"},
        {FORMAT, "{\"nebel\": 1`; \"fog\": []}", "found ';'; a comma or } must follow the value"},
        {FORMAT, "{\"background\": [1, 2`: 3]", "background: a colon stands between a key and its value only"},
        {FORMAT, "{\"nebel\" `1}", "the key needs a colon and a value: \"nebel\": ..."},
        {FORMAT, "{\"nebel\" `= 1}", "the key needs a colon and a value"},
        {FORMAT, "{\"nebel\"`}", "the key needs a colon and a value"},
        {FORMAT, "{\"nebel\":`}", "nebel: the key has no value; write one before the }"},
        {FORMAT, "{\"nebel\":`, \"fog\": []}", "nebel: the key has no value; write one before the ,"},
        {FORMAT, "{\"nebel\":`:1}", "nebel: found ':'; a value must stand here"},
    };
    CHECK(rules);
}

static void test_brackets(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, FOG("]`]}"),
         "] cannot close the object that began at line 1, column 1; is a } missing before it, or is it one too many?"},
        {FORMAT, FOG("\n`}"), "fog: } cannot close the array that began at line 1, column 21; is a ] missing"},
        {FORMAT, FOG("\n{\"name\": \"a\"`]}"), "fog[0]: ] cannot close the object that began at line 2, column 1"},
        {FORMAT, "{`]", "] cannot close the object that began at line 1, column 1"},
        {FORMAT, "{\"nebel\": 1, `]", "] cannot close the object"},
        {FORMAT, FOG("]}`}"),
         "the scene is complete, its last } is at line 1, column 23; remove that } or what follows"},
        {FORMAT, FOG("]}\n `{}"), "the scene is complete, its last } is at line 1, column 23"},
        {FORMAT, FOG("]} `x"), "the scene is complete"},
    };
    CHECK(rules);
}

static void test_files_that_end_too_early(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, "{`",
         "the file ends inside the object that began at line 1, column 1; is it cut off, or is a } missing?"},
        {FORMAT, FOG("`"),
         "fog: the file ends inside the array that began at line 1, column 21; is it cut off, or is a ]"},
        {FORMAT, FOG("\n {\"shape\": {\"type\": \"world\"}, \"extinction\": 1\n`"),
         "fog[0]: the file ends inside the object that began at line 2, column 2"},
        {FORMAT, FOG("\n {\"shape\":\n {\"type\": `"),
         "fog[0].shape: the file ends inside the object that began at line 3"},
        {FORMAT, "{\"background\": [1, 2`",
         "background: the file ends inside the array that began at line 1, column 16"},
        {FORMAT, "{\"background\": tru`", "the file ends inside the object"},
        {FORMAT, "{\"background\": -`", "the file ends inside the object"},
        {FORMAT, "{\"background\": `\"gre",
         "background: the file ends inside this string; is it cut off, or is a \" missing?"},
        {FORMAT, "{`\"backgr\\", "the file ends inside this string"},
        {FORMAT, FOG("]} `/* open"), "the file ends within this comment; close it with */"},
        {FORMAT, FOG("`/* open"), "fog: the file ends within this comment"},
        {FORMAT, "`/* open *", "the file ends within this comment"},
    };
    CHECK(rules);
}

static void test_numbers_and_words(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, "{\"nebel\": `NaN, \"fog\": []}", "nebel: JSON has no NaN; write a finite number such as 0.5 or 2e3"},
        {FORMAT, "{\"background\": [0, `-Infinity, 0]", "background[1]: JSON has no -Infinity"},
        {FORMAT, "{\"nebel\": `+inf}", "nebel: JSON has no +inf"},
        {FORMAT, "{\"nebel\": `True}", "nebel: True is written in small letters"},
        {FORMAT, FOG("{\"shape\": `box}]}"), "fog[0].shape: texts stand in double quotes; write \"box\""},
        {FORMAT, "{`nebel: 1}", "keys stand in double quotes; write \"nebel\""},
        {FORMAT, FOG("], `scale_height: 1}"), "keys stand in double quotes; write \"scale_height\""},
        {FORMAT, "{\"nebel\": `.5, \"fog\": []}", "nebel: .5 is no number of JSON; write 0 before the point"},
        {FORMAT, "{\"nebel\": `-.5, \"fog\": []}", "nebel: -.5 is no number of JSON; write 0 before the point"},
        {FORMAT, "{\"nebel\": `+5, \"fog\": []}", "nebel: +5 is no number of JSON; leave out the +"},
        {FORMAT, "{\"nebel\": `-, \"fog\": []}", "nebel: - is no number of JSON; a digit must follow the -"},
        {FORMAT, "{\"nebel\": `1., \"fog\": []}",
         "nebel: 1. is no number of JSON; leave out the point, or write a digit behind"},
        {FORMAT, "{\"nebel\": `1e, \"fog\": []}",
         "nebel: 1e is no number of JSON; digits must follow the e, as in 2e3"},
        {FORMAT, "{\"background\": [`01, 0, 0]}", "background[0]: 01 is no number of JSON; leave out the 0 in front"},
        {FORMAT, "{\"background\": `0x10}",
         "background: 0x10 is no number of JSON; numbers are decimal: -0.5, 12, 2e3"},
        {FORMAT, "{\"background\": `12m}",
         "background: 12m is no number of JSON; write it without a unit: -0.5, 12, 2e3"},
        {FORMAT, FOG("{\"extinction\": `12m}]}"), "fog[0].extinction: 12m is no number of JSON"},
        {FORMAT, "{\"unit\": `1cm}", "unit: 1cm is no number of JSON; write it without a unit"},
        {FORMAT, "{\"unit\": 1 `cm}", "unit: a number has no unit behind it; remove this"},
        {FORMAT, "{\"camera\": {\"vertical_fov\": 50`\u00b0}}", "camera.vertical_fov: a number has no unit behind it"},
        {FORMAT, FOG("{\"visibility\": 60 `m, \"name\": 1}]}"), "fog[0].visibility: a number has no unit behind it"},
        {FORMAT, FOG("{\"source\": [1, 60 `%]}]}"), "fog[0].source[1]: a number has no unit behind it"},
        {FORMAT, FOG("{\"visibility\": 60 `name: 1}]}"), "fog[0]: a comma is missing before this"},
        {FORMAT, "{\"background\": `1_000}", "background: 1_000 is no number of JSON; numbers look like -0.5, 12, 2e3"},
        {FORMAT, "{\"background\": `2.5E-}", "background: 2.5E- is no number of JSON; digits must follow the e"},
        {FORMAT, FOG("{\"extinction\": `NaN}]}"), "fog[0].extinction: JSON has no NaN"},
        {FORMAT, "{\"background\": `[0,5, 0,6, 0,7]}",
         "background: has 6 elements; must be an array of 3 numbers; decimals have a point, 0.5"},
        {FORMAT, "{\"background\": 1,`5}", "a number, but a key must follow the comma; decimals have a point"},
        {FORMAT, "{`1: 2}", "found '1'; a key in double quotes must stand here"},
        {FORMAT, "{`{}}", "found '{'; a key in double quotes must stand here"},
        {FORMAT, "{\"nebel\": `(1)}", "nebel: found '('; a value must stand here"},
        {FORMAT, "{\"nebel\": `\u00e4}", "nebel: found '\u00e4'; a value must stand here"},
    };
    CHECK(rules);
}

static void test_strings(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, "{`'nebel': 1}", "strings and keys stand in straight double quotes"},
        {FORMAT, "{\"nebel\": `'1'}", "nebel: strings and keys stand in straight double quotes"},
        {FORMAT, "{`\u201cnebel\u201d: 1}", "strings and keys stand in straight double quotes"},
        {FORMAT, "{\"nebel\": `\u00ab1\u00bb}", "nebel: strings and keys stand in straight double quotes"},
        {FORMAT, FOG("{\"name\": \"the \"`good\" one\"}"),
         "fog[0]: the string before this ends here; a comma is missing"},
        {FORMAT, FOG("{\"name\": \"a`\\xb\"}"),
         "fog[0].name: this \\ begins no escape that JSON knows; write \\\\ for a"},
        {FORMAT, FOG("{\"name\": \"a`\\u12g4\"}"), "fog[0].name: \\u needs four hexadecimal digits behind it"},
        {FORMAT, FOG("{\"name\": \"\\n`\t\"}"), "fog[0].name: a tab inside a string; write \\t or a blank"},
        {FORMAT, FOG("{\"name\": `\"a\n}"), "fog[0].name: this string has no end on its line; close it with \""},
        {FORMAT, FOG("{`\"name: \n}"), "fog[0]: this string has no end on its line"},
        {FORMAT, FOG("{\"name\": `\"\\ud800\"}]}"), "fog[0].name: an escape \\uD800 to \\uDFFF stands alone"},
        {FORMAT, FOG("{\"name\": `\"\\udc00\\ud800\"}]}"), "fog[0].name: an escape \\uD800 to \\uDFFF stands alone"},
    };
    CHECK(rules);
}

static void test_comments(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, "{\"nebel\": 1, `# one\n \"fog\": []}", "a comment begins with // here, not with #"},
        {FORMAT, "`# one\n{}", "found '#'; a scene is an object and begins with {, a comment with //"},
        {FORMAT, FOG("]}\n`# end"), "a comment begins with // here, not with #"},
        {FORMAT, "{\"nebel\": 1, `/ one\n \"fog\": []}", "a comment begins with // or /*; this is one / alone"},
    };
    CHECK(rules);
    nebel_destroy_scene(parse_good("// a\n{\"nebel\": 1, // b\n /* , : */ \"fog\" /* c */ : [/**/]/***/}// d"));
}

static void test_what_is_no_scene_at_all(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, "`", "the file is empty; a scene holds at least"},
        {FORMAT, " \n // only this\n`", "the file is empty"},
        {FORMAT, "`[]", "found an array; a scene is an object and begins with {: at least {\"nebel\": 1, \"fog\": []}"},
        {FORMAT, "`12", "found a number; a scene is an object and begins with {"},
        {FORMAT, "\n`12m", "found a number; a scene is an object and begins with {"},
        {FORMAT, "`\"a\"", "found a string; a scene is an object"},
        {FORMAT, "`nebel: 1", "found 'nebel'; a scene is an object and begins with {"},
        {FORMAT, "\n `<scene>", "found '<'; a scene is an object and begins with {"},
        {FORMAT, "`\xEF\xBB\xBF{}", "the file starts with a byte order mark; save it as UTF-8 without one"},
        {FORMAT, "`\x89PNG\r\n", "this is no text; a scene is a JSON text, saved as UTF-8"},
        {FORMAT, "glTF`\x02", "this is no text; a scene is a JSON text, saved as UTF-8"},
        {FORMAT, FOG("{\"name\": \"d`\xFCnn\"}]}"), "the byte 0xFC is not UTF-8 here"},
        {FORMAT, FOG("{\"name\": \"`\xC0\x80\"}]}"), "the byte 0xC0 is not UTF-8 here"},
        {FORMAT, FOG("{\"name\": \"`\xED\xA0\x80\"}]}"), "the byte 0xED is not UTF-8 here"},
        {FORMAT, FOG("{\"name\": \"`\xF4\x90\x80\x80\"}]}"), "the byte 0xF4 is not UTF-8 here"},
        {FORMAT, "{\"nebel\": 1,`\v \"fog\": []}", "the control character 0x0B is not possible in JSON; remove it"},
    };
    CHECK(rules);
}

static void test_utf_16(void **state)
{
    (void)state;
    const char *const texts[] = {"\xFF\xFE{\0}\0", "\xFE\xFF\0{\0}", "{\0\"\0n\0", "\0{\0\"\0n"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        meter m;
        journal kept;
        nebel_scene *scene;
        const nebel_scene_desc desc = metered_desc(&m, &kept);
        assert_int_equal(nebel_parse_scene(texts[i], 6, "a.json", &desc, &scene), NEBEL_ERROR_FORMAT);
        assert_string_equal(kept.last, "a.json:1:1: the file is UTF-16; save it as UTF-8");
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_commas_and_colons),
        cmocka_unit_test(test_brackets),
        cmocka_unit_test(test_files_that_end_too_early),
        cmocka_unit_test(test_numbers_and_words),
        cmocka_unit_test(test_strings),
        cmocka_unit_test(test_comments),
        cmocka_unit_test(test_what_is_no_scene_at_all),
        cmocka_unit_test(test_utf_16),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

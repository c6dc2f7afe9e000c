/* Cameras of data sets. Where the files come from: nebel/photograph.h. */
#define _POSIX_C_SOURCE 200809L
#include <nebel/photograph.h>

#include "image/image_codec.h"
#include "json/json.h"
#include "json/number.h"

#include <ctype.h>
#include <math.h>

enum { FILE_LIMIT = 1 << 20, MOST_NUMBERS = 16 };

typedef struct intrinsics_reader {
    const nb_codec *codec;
    const char *text; /* `size` bytes, and a zero */
    size_t size;
    locale_t c_locale;
} intrinsics_reader;

/* ---- numbers in text ------------------------------------------------------------------------- */

static bool is_between(char c)
{
    return isspace((unsigned char)c) || c == ',' || c == ';' || c == '[' || c == ']';
}

static const char *skip_digits(const char *at)
{
    while (*at >= '0' && *at <= '9') at++;
    return at;
}

/* Where a decimal number that begins at `at` ends; `at` itself where there is none. */
static const char *end_of_number(const char *at)
{
    const char *digits = *at == '-' ? at + 1 : at;
    const char *end = skip_digits(digits);
    if (end == digits) return at;
    if (*end == '.') end = skip_digits(end + 1);
    if (*end != 'e' && *end != 'E') return end;
    digits = end[1] == '+' || end[1] == '-' ? end + 2 : end + 1;
    const char *last = skip_digits(digits);
    return last > digits ? last : end;
}

/* Up to `most` numbers from `at` to `end`, with nothing else between them; -1: something else stands there. */
static int read_number_list(const intrinsics_reader *in, const char *at, const char *end, int most, double *numbers)
{
    int count = 0;
    for (;; count++) {
        while (at < end && is_between(*at)) at++;
        if (at >= end) return count;
        const char *last = end_of_number(at);
        if (last == at || last > end || count == most) return -1;
        if (!nb_number_parse(at, (size_t)(last - at), in->c_locale, &numbers[count])) return -1;
        at = last;
    }
}

/* What stands behind a word at the beginning of a line, up to the line's end; NULL: no line begins so. */
static const char *find_line(const intrinsics_reader *in, const char *word, const char **end)
{
    for (const char *line = in->text; line != NULL && *line != '\0';) {
        *end = strchr(line, '\n');
        const char *at = line;
        while (*at == ' ' || *at == '\t') at++;
        const char *next = *end != NULL ? *end + 1 : NULL;
        if (*end == NULL) *end = in->text + in->size;
        if (strncmp(at, word, strlen(word)) == 0) return at + strlen(word);
        line = next;
    }
    return NULL;
}

static nebel_result fail_intrinsics(const intrinsics_reader *in, const char *what)
{
    return nb_fail(&in->codec->log, NEBEL_ERROR_FORMAT, "%s: not a camera: %s", in->codec->name, what);
}

/* ---- kinds of files -------------------------------------------------------------------------- */

static void take_matrix(const double *m, int columns, nebel_intrinsics *camera)
{
    *camera = (nebel_intrinsics){.fx = m[0], .fy = m[columns + 1], .cx = m[2], .cy = m[columns + 2]};
}

static nebel_result read_plain(const intrinsics_reader *in, nebel_intrinsics *camera)
{
    double m[MOST_NUMBERS];
    const int count = read_number_list(in, in->text, in->text + in->size, MOST_NUMBERS, m);
    if (count == 9 || count == 16) {
        take_matrix(m, count == 9 ? 3 : 4, camera);
        return NEBEL_OK;
    }
    if (count != 4 && count != 5)
        return fail_intrinsics(
            in, "write fx fy cx cy and nothing else, or give JSON of Cityscapes, a calib.txt of KITTI or "
                "YAML of OpenCV");
    *camera = (nebel_intrinsics){m[0], m[1], m[2], m[3], count == 5 ? m[4] : 0};
    return NEBEL_OK;
}

/* The left color camera is 2, the right one 3; the fourth column is -fx times the way from camera 0 (A. Geiger and others,
 * "Vision meets robotics: the KITTI dataset", 2013). */
static nebel_result read_kitti(const intrinsics_reader *in, const char *left, const char *right,
                               nebel_intrinsics *camera)
{
    double m[12], other[12];
    const char *end, *at = find_line(in, left, &end);
    if (at == NULL || read_number_list(in, at, end, 12, m) != 12) return fail_intrinsics(in, "P2 must have 12 numbers");
    take_matrix(m, 4, camera);
    at = find_line(in, right, &end);
    if (at != NULL && read_number_list(in, at, end, 12, other) == 12 && m[0] > 0)
        camera->baseline = fmax(0, (m[3] - other[3]) / m[0]);
    return NEBEL_OK;
}

static nebel_result read_yaml(const intrinsics_reader *in, nebel_intrinsics *camera)
{
    double m[9];
    const char *line_end, *at = find_line(in, "camera_matrix:", &line_end);
    if (at == NULL) at = find_line(in, "K:", &line_end);
    const char *data = at != NULL ? strstr(at, "data:") : NULL;
    const char *open = data != NULL ? strchr(data, '[') : NULL, *close = open != NULL ? strchr(open, ']') : NULL;
    if (close == NULL || read_number_list(in, open, close, 9, m) != 9)
        return fail_intrinsics(in, "camera_matrix must have data of 9 numbers");
    take_matrix(m, 3, camera);
    return NEBEL_OK;
}

/* Numbers that Cityscapes names, and where they go. */
typedef struct cityscapes {
    nebel_intrinsics camera;
    unsigned found; /* bits, in the order of the names */
} cityscapes;

static void take_member(const nb_json_node *node, bool is_intrinsic, cityscapes *all)
{
    static const char *const names[] = {"fx", "fy", "u0", "v0", "baseline"};
    double *const places[] = {&all->camera.fx, &all->camera.fy, &all->camera.cx, &all->camera.cy,
                              &all->camera.baseline};
    for (unsigned i = 0; i < 5; i++)
        if (is_intrinsic == (i < 4) && node->type == NB_JSON_NUMBER && nb_json_has_key(node, names[i])) {
            *places[i] = node->number;
            all->found |= 1u << i;
        }
}

static bool take_section(nb_json *json, const nb_json_node *value, void *user)
{
    cityscapes *all = user;
    const bool is_intrinsic = nb_json_has_key(value, "intrinsic");
    if (value->type != NB_JSON_OBJECT || (!is_intrinsic && !nb_json_has_key(value, "extrinsic"))) return true;
    for (const nb_json_node *node = nb_json_first(json, value); node != NULL; node = nb_json_next(json, node))
        take_member(node, is_intrinsic, all);
    return true;
}

static nebel_result read_cityscapes(const intrinsics_reader *in, nebel_intrinsics *camera)
{
    static const char *const streamed[] = {NULL};
    cityscapes all = {0};
    nb_json json;
    const nb_json_desc desc = {.text = in->text,
                               .size = in->size,
                               .name = in->codec->name,
                               .allocator = in->codec->allocator,
                               .log = in->codec->log,
                               .streamed = streamed,
                               .take = take_section,
                               .user = &all};
    const nebel_result result = nb_json_read(&json, &desc);
    if (result != NEBEL_OK) return result;
    if ((all.found & 15) != 15) return fail_intrinsics(in, "JSON needs intrinsic with fx, fy, u0 and v0");
    *camera = all.camera;
    return NEBEL_OK;
}

static nebel_result read_text(const intrinsics_reader *in, nebel_intrinsics *camera)
{
    const char *end, *first = in->text;
    while (isspace((unsigned char)*first)) first++;
    if (*first == '{') return read_cityscapes(in, camera);
    if (find_line(in, "P2:", &end) != NULL) return read_kitti(in, "P2:", "P3:", camera);
    if (find_line(in, "P_rect_02:", &end) != NULL) return read_kitti(in, "P_rect_02:", "P_rect_03:", camera);
    if (find_line(in, "camera_matrix:", &end) != NULL || find_line(in, "K:", &end) != NULL)
        return read_yaml(in, camera);
    return read_plain(in, camera);
}

/* ---- checks ---------------------------------------------------------------------------------- */

static const char *fault_of(const nebel_intrinsics *camera)
{
    /* The ways to the pixels, at most 1e9 / 1e-6, are floats. */
    if (!(camera->fx >= 1e-6 && camera->fx <= 1e9 && camera->fy >= 1e-6 && camera->fy <= 1e9))
        return "focal lengths must be 1e-6 to 1e9 pixels";
    if (!(fabs(camera->cx) <= 1e9 && fabs(camera->cy) <= 1e9)) return "cx and cy must be finite and at most 1e9";
    if (!(camera->baseline >= 0 && camera->baseline <= 1e9)) return "the baseline must be 0 to 1e9 m";
    return NULL;
}

static nebel_result read_checked(const nb_codec *codec, const nb_bytes *bytes, nebel_intrinsics *camera)
{
    intrinsics_reader in = {codec, nb_allocate_zero(&codec->allocator, bytes->size + 1, 1), bytes->size, (locale_t)0};
    in.c_locale = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    nebel_result result = NEBEL_ERROR_MEMORY;
    if (in.text != NULL && in.c_locale != (locale_t)0) {
        memcpy((char *)in.text, bytes->data, bytes->size);
        result =
            memchr(in.text, '\0', in.size) == NULL ? read_text(&in, camera) : fail_intrinsics(&in, "it is no text");
        const char *fault = result == NEBEL_OK ? fault_of(camera) : NULL;
        if (fault != NULL) result = nb_fail(&codec->log, NEBEL_ERROR_VALUE, "%s: %s", codec->name, fault);
    } else {
        nb_fail(&codec->log, result, "%s: out of memory", codec->name);
    }
    if (in.c_locale != (locale_t)0) freelocale(in.c_locale);
    nb_release(&codec->allocator, (char *)in.text);
    return result;
}

nebel_result nebel_read_intrinsics(const char *path, const nebel_host *host, nebel_intrinsics *intrinsics)
{
    nb_codec codec;
    nb_bytes bytes;
    nebel_intrinsics camera = {0};
    if (intrinsics != NULL) *intrinsics = (nebel_intrinsics){0};
    if (path == NULL || host == NULL || intrinsics == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = nb_codec_prepare(host, path, &codec);
    if (result == NEBEL_OK)
        result = nb_file_read(&codec.allocator, &codec.log, NULL, "camera", path, FILE_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    result = read_checked(&codec, &bytes, &camera);
    nb_release(&codec.allocator, bytes.data);
    if (result == NEBEL_OK) *intrinsics = camera;
    return result;
}

/* ---- rays ------------------------------------------------------------------------------------ */

nebel_intrinsics nebel_intrinsics_of_view(double degrees, uint32_t width, uint32_t height)
{
    const double pi = 3.14159265358979324, f = width / 2.0 / tan(degrees * pi / 360);
    return (nebel_intrinsics){f, f, (width - 1.0) / 2, (height - 1.0) / 2, 0};
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int i = 0; i < 3; i++) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

static bool normalize(double v[3])
{
    const double length = sqrt(dot(v, v));
    if (!(length > 0 && length < HUGE_VAL)) return false;
    for (int i = 0; i < 3; i++) v[i] /= length;
    return true;
}

nebel_result nebel_aim_pixels(nebel_pixels *pixels, const nebel_intrinsics *intrinsics, const nebel_camera *camera)
{
    double ahead[3] = {0, 0, -1}, up[3] = {0, 1, 0}, right[3], eye[3] = {0};
    if (pixels == NULL || intrinsics == NULL || fault_of(intrinsics) != NULL) return NEBEL_ERROR_ARGUMENT;
    for (int i = 0; i < 3 && camera != NULL; i++) {
        eye[i] = camera->position[i];
        ahead[i] = camera->look_at[i] - camera->position[i];
        up[i] = camera->up[i];
    }
    if (!normalize(ahead) || !normalize(up)) return NEBEL_ERROR_ARGUMENT;
    cross(ahead, up, right);
    if (!normalize(right)) return NEBEL_ERROR_ARGUMENT;
    cross(right, ahead, up);
    for (int i = 0; i < 3; i++) {
        pixels->eye[i] = eye[i];
        pixels->step_x[i] = (float)(right[i] / intrinsics->fx);
        pixels->step_y[i] = (float)(-up[i] / intrinsics->fy);
        pixels->corner[i] =
            (float)(ahead[i] - intrinsics->cx / intrinsics->fx * right[i] + intrinsics->cy / intrinsics->fy * up[i]);
    }
    return NEBEL_OK;
}

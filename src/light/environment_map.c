/* Skies in a picture, by spherical harmonics: a convolution with a phase function, or with the cosine of a surface,
 * multiplies them by a number for each degree (Funk and Hecke; Driscoll and Healy, Computing Fourier Transforms and
 * Convolutions on the 2-Sphere, 1994), so that no lobe is ever sampled and none can alias.
 *
 * Degrees above LAST are left out. Where a phase function is so sharp that this would show, the heat kernel of the
 * sphere, exp(-l (l + 1) s^2 / 2), blurs the map just so much that it does not: by s <= 1.1 degrees. What comes of it is
 * a table of B-splines over longitude and latitude. */
#include "environment_map.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { LAST = 255, ORDERS = LAST + 1, MOST_FILTERS = 8 };

/* Of degree l and order m, 0 <= m <= l: all degrees of an order stand together. */
#define TERM(l, m) ((size_t)(m) * (2 * (size_t)ORDERS - 1 - (size_t)(m)) / 2 + (size_t)(l))
#define TERMS (TERM(LAST, LAST) + 1)

/* What a filter may leave out, relative to what it keeps. */
#define NEGLIGIBLE 1e-5

/* Of cos(m longitude) and sin(m longitude), in each channel. */
typedef struct term {
    double even[3], odd[3];
} term;

struct nebel_environment_map {
    nebel_allocator allocator;
    atomic_size_t owners;
    size_t width, height;
    float *pixels;
    double most[3];
    term *terms;
    nb_environment_table reflected;
    atomic_flag lock; /* of what follows; held for a few instructions */
    nb_environment_filter *filters[MOST_FILTERS];
    size_t next_filter;
};

/* ---- Fourier --------------------------------------------------------------------------------- */

typedef struct complex_number {
    double re, im;
} complex_number;

static complex_number product(complex_number a, complex_number b)
{
    return (complex_number){a.re * b.re - a.im * b.im, a.re * b.im + a.im * b.re};
}

static complex_number unit_complex(double angle)
{
    return (complex_number){cos(angle), sin(angle)};
}

/* A power of two of values, and e^(i way 2 pi k / count) for half as many k. */
typedef struct fourier {
    size_t count;
    complex_number *values, *turns;
} fourier;

static size_t power_of_two(size_t least)
{
    size_t power = 1;
    while (power < least) power *= 2;
    return power;
}

/* 0 when memory is out. */
static int open_fourier(const nebel_allocator *allocator, size_t count, double way, fourier *f)
{
    f->count = count;
    f->values = nb_allocate(allocator, count + count / 2, sizeof *f->values);
    if (f->values == NULL) return 0;
    f->turns = f->values + count;
    for (size_t k = 0; k < count / 2; k++) f->turns[k] = unit_complex(way * 2 * PI * (double)k / (double)count);
    return 1;
}

static void close_fourier(const nebel_allocator *allocator, fourier *f)
{
    nb_release(allocator, f->values);
}

/* values[k] = sum of values[j] e^(i way 2 pi j k / count): Cooley and Tukey. */
static void transform(const fourier *f)
{
    const size_t count = f->count;
    complex_number *values = f->values;
    for (size_t i = 1, j = 0; i < count; i++) {
        size_t bit = count / 2;
        for (; (j & bit) != 0; bit /= 2) j ^= bit;
        j |= bit;
        if (i >= j) continue;
        const complex_number other = values[i];
        values[i] = values[j];
        values[j] = other;
    }
    for (size_t size = 2; size <= count; size *= 2) {
        for (size_t first = 0; first < count; first += size) {
            for (size_t k = first; k < first + size / 2; k++) {
                const complex_number turn = f->turns[(k - first) * (count / size)];
                const complex_number a = values[k], b = product(values[k + size / 2], turn);
                values[k] = (complex_number){a.re + b.re, a.im + b.im};
                values[k + size / 2] = (complex_number){a.re - b.re, a.im - b.im};
            }
        }
    }
}

/* ---- Legendre -------------------------------------------------------------------------------- */

/* Recurrence of the associated Legendre functions, normalised so that harmonics are orthonormal over the sphere. */
typedef struct recurrence {
    double sectoral[ORDERS], forward[TERMS], backward[TERMS];
} recurrence;

static void fill_recurrence(recurrence *r)
{
    r->sectoral[0] = sqrt(1 / (4 * PI));
    for (int m = 1; m <= LAST; m++) r->sectoral[m] = sqrt((2.0 * m + 1) / (2.0 * m));
    for (int l = 1; l <= LAST; l++) {
        for (int m = 0; m < l; m++) {
            const double square = (double)l * l, order = (double)m * m, before = (double)(l - 1) * (l - 1);
            r->forward[TERM(l, m)] = sqrt((4 * square - 1) / (square - order));
            r->backward[TERM(l, m)] = l - 1 > m ? sqrt((before - order) / (4 * before - 1)) : 0;
        }
    }
}

/* All of them up to degree `last` at a colatitude. */
static void legendre(const recurrence *r, int last, double cosine, double sine, double *values)
{
    double sectoral = r->sectoral[0];
    for (int m = 0; m <= last; m++) {
        if (m > 0) sectoral *= r->sectoral[m] * sine;
        double before = 0, here = sectoral;
        values[TERM(m, m)] = here;
        for (int l = m + 1; l <= last; l++) {
            const double next = r->forward[TERM(l, m)] * (cosine * here - r->backward[TERM(l, m)] * before);
            before = here;
            here = next;
            values[TERM(l, m)] = next;
        }
    }
}

/* ---- from pixels to harmonics ---------------------------------------------------------------- */

/* A row's integrals over longitude times e^(-i m longitude), in each channel. */
typedef struct row_orders {
    complex_number order[3][ORDERS];
} row_orders;

/* Linear between the middles of pixels, which multiplies the transform by a square of sin x / x. Pixels are shared out
 * between the two nearest of `count` points; where the width is a power of two that is one. */
static void transform_row(const nebel_environment_map *map, size_t row, const fourier *f, row_orders *to)
{
    const double step = 2 * PI / (double)map->width;
    const size_t count = f->count;
    const int aligned = count == map->width;
    for (int c = 0; c < 3; c++) {
        memset(f->values, 0, count * sizeof *f->values);
        for (size_t i = 0; i < map->width; i++) {
            const double value = (double)map->pixels[3 * (row * map->width + i) + (size_t)c];
            const double place = ((double)i + (aligned ? 0 : 0.5)) * (double)count / (double)map->width;
            const size_t left = (size_t)place;
            const double share = place - (double)left;
            f->values[left % count].re += (1 - share) * value;
            f->values[(left + 1) % count].re += share * value;
        }
        transform(f);
        for (int m = 0; m < ORDERS; m++) {
            const double half = 0.5 * m * step, sinc = m > 0 ? sin(half) / half : 1;
            const complex_number phase = unit_complex(aligned ? -half : 0), at = f->values[(size_t)m % count];
            const complex_number value = product(at, phase);
            to->order[c][m] = (complex_number){value.re * step * sinc * sinc, value.im * step * sinc * sinc};
        }
    }
}

/* Weights of Fejer's first rule: exact for polynomials of the cosine up to degree count - 1. */
static double fejer_weight(size_t count, double angle)
{
    double sum = 0, last = 1, here = cos(2 * angle);
    const double twice = 2 * here;
    for (size_t k = 1; k <= count / 2; k++) {
        sum += here / (4.0 * (double)k * (double)k - 1);
        const double next = twice * here - last;
        last = here;
        here = next;
    }
    return 2 / (double)count * (1 - 2 * sum);
}

/* Rows are linear between their middles and level beyond the outermost. */
static void add_latitude(nebel_environment_map *map, const row_orders *rows, const double *values, double angle,
                         double weight)
{
    const double place = fmin(fmax(angle / PI * (double)map->height - 0.5, 0), (double)map->height - 1);
    const size_t upper = (size_t)place, lower = upper + 1 < map->height ? upper + 1 : upper;
    const double share = place - (double)upper;
    for (int m = 0; m <= LAST; m++) {
        double even[3], odd[3];
        for (int c = 0; c < 3; c++) {
            const complex_number a = rows[upper].order[c][m], b = rows[lower].order[c][m];
            even[c] = weight * ((1 - share) * a.re + share * b.re);
            odd[c] = -weight * ((1 - share) * a.im + share * b.im);
        }
        for (int l = m; l <= LAST; l++) {
            term *t = &map->terms[TERM(l, m)];
            const double value = values[TERM(l, m)];
            for (int c = 0; c < 3; c++) {
                t->even[c] += value * even[c];
                t->odd[c] += value * odd[c];
            }
        }
    }
}

static void integrate_latitudes(nebel_environment_map *map, const row_orders *rows, const recurrence *r, double *values)
{
    const size_t times = (2 * LAST + map->height) / map->height, count = times * map->height;
    for (size_t j = 0; j < count; j++) {
        const double angle = PI * ((double)j + 0.5) / (double)count;
        legendre(r, LAST, cos(angle), sin(angle), values);
        add_latitude(map, rows, values, angle, fejer_weight(count, angle));
    }
}

/* 0 when memory is out. */
static int analyse(nebel_environment_map *map, const recurrence *r)
{
    const size_t fit = power_of_two(map->width), count = fit == map->width ? fit : NEBEL_MAX_ENVIRONMENT_WIDTH;
    row_orders *rows = nb_allocate(&map->allocator, map->height, sizeof *rows);
    double *values = nb_allocate(&map->allocator, TERMS, sizeof *values);
    fourier f;
    const int got = open_fourier(&map->allocator, count, -1, &f) && rows != NULL && values != NULL;
    for (size_t i = 0; got && i < map->height; i++) transform_row(map, i, &f, &rows[i]);
    if (got) integrate_latitudes(map, rows, r, values);
    nb_release(&map->allocator, rows);
    close_fourier(&map->allocator, &f);
    nb_release(&map->allocator, values);
    return got;
}

/* ---- from harmonics to tables ---------------------------------------------------------------- */

/* Nodes of a B-spline through the values of a circle: z / (1 - z^2) z^|n|, z = sqrt(3) - 2, and the transform of it
 * (Unser, Aldroubi and Eden, B-Spline Signal Processing, 1993), by its two recursive filters. */
static void find_nodes(double *values, size_t count)
{
    const double pole = sqrt(3.0) - 2;
    enum { RUN_UP = 32 }; /* pole^32 is below 1e-18 */
    double before = 0;
    for (size_t i = 0; i < RUN_UP; i++) before = values[(i + count * RUN_UP - RUN_UP) % count] + pole * before;
    for (size_t i = 0; i < count; i++) before = values[i] = values[i] + pole * before;
    double after = 0;
    for (size_t i = RUN_UP; i-- > 0;) after = pole * (after - values[i % count]);
    for (size_t i = count; i-- > 0;) after = values[i] = pole * (after - values[i]);
    for (size_t i = 0; i < count; i++) values[i] *= 6;
}

/* Nodes along every circle of latitude, then along every great circle through the poles: down one column and up the
 * opposite one. */
static void make_splines(nb_environment_table *table, double *circle)
{
    const size_t columns = table->columns, rows = table->rows;
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < rows; i++) {
            float *row = &table->coefficients[3 * i * columns + (size_t)c];
            for (size_t j = 0; j < columns; j++) circle[j] = (double)row[3 * j];
            find_nodes(circle, columns);
            for (size_t j = 0; j < columns; j++) row[3 * j] = (float)circle[j];
        }
        for (size_t j = 0; j < rows; j++) {
            float *down = &table->coefficients[3 * j + (size_t)c], *up = down + 3 * rows;
            for (size_t i = 0; i < rows; i++) {
                circle[i] = (double)down[3 * i * columns];
                circle[columns - 1 - i] = (double)up[3 * i * columns];
            }
            find_nodes(circle, columns);
            for (size_t i = 0; i < rows; i++) {
                down[3 * i * columns] = (float)circle[i];
                up[3 * i * columns] = (float)circle[columns - 1 - i];
            }
        }
    }
}

/* A row of a table: the sum of all harmonics up to `last`, times the factors of their degrees. */
static void sum_row(const nebel_environment_map *map, const double *factors, int last, const double *values,
                    const fourier *f, float *row)
{
    for (int c = 0; c < 3; c++) {
        memset(f->values, 0, f->count * sizeof *f->values);
        for (int m = 0; m <= last; m++) {
            complex_number sum = {0, 0};
            for (int l = m; l <= last; l++) {
                const double weight = factors[l] * values[TERM(l, m)];
                sum.re += weight * map->terms[TERM(l, m)].even[c];
                sum.im -= weight * map->terms[TERM(l, m)].odd[c];
            }
            const double both = m > 0 ? 2 : 1;
            const complex_number middle = unit_complex(PI * m / (double)f->count); /* of the first column */
            const complex_number turned = product(sum, middle);
            f->values[m] = (complex_number){both * turned.re, both * turned.im};
        }
        transform(f);
        for (size_t j = 0; j < f->count; j++) row[3 * j + (size_t)c] = (float)f->values[j].re;
    }
}

/* The last degree that is not negligible. */
static int last_of(const double factors[ORDERS])
{
    int last = LAST;
    while (last > 0 && fabs(factors[last]) < NEGLIGIBLE) last--;
    return last;
}

/* 0 when memory is out. */
static int fill_table(const nebel_environment_map *map, const double factors[ORDERS], const recurrence *r,
                      nb_environment_table *table)
{
    const int last = last_of(factors);
    const nebel_allocator *a = &map->allocator;
    table->columns = power_of_two((size_t)(last > 2 ? 4 * last : 16));
    table->rows = table->columns / 2;
    table->coefficients = nb_allocate(a, 3 * table->rows * table->columns, sizeof *table->coefficients);
    double *values = nb_allocate(a, TERMS, sizeof *values), *circle = nb_allocate(a, table->columns, sizeof *circle);
    fourier f;
    const int got =
        open_fourier(a, table->columns, 1, &f) && table->coefficients != NULL && values != NULL && circle != NULL;
    for (size_t i = 0; got && i < table->rows; i++) {
        const double angle = PI * ((double)i + 0.5) / (double)table->rows;
        legendre(r, last, cos(angle), sin(angle), values);
        sum_row(map, factors, last, values, &f, &table->coefficients[3 * i * table->columns]);
    }
    if (got) make_splines(table, circle);
    nb_release(a, values);
    nb_release(a, circle);
    close_fourier(a, &f);
    return got;
}

/* ---- filters --------------------------------------------------------------------------------- */

/* Lambert's cosine over pi: Ramamoorthi and Hanrahan, An Efficient Representation for Irradiance Environment Maps,
 * 2001. */
static void set_cosine_factors(double factors[ORDERS])
{
    double ratio = 1; /* l! / (2^l (l / 2)!^2) */
    for (int l = 0; l <= LAST; l++) {
        factors[l] = l == 1 ? 2.0 / 3 : 0;
        if (l % 2 != 0) continue;
        if (l > 0) ratio *= (l - 1.0) / l;
        factors[l] = (l % 4 == 2 ? 2 : -2) * ratio / ((l + 2.0) * (l - 1.0));
    }
}

/* Legendre coefficients of a lobe: g^l without alpha; c P_l = ((l + 1) P_(l+1) + l P_(l-1)) / (2 l + 1), twice, gives
 * those of c^2 times that. */
static void add_lobe(const nb_lobe *lobe, double factors[ORDERS])
{
    double plain[ORDERS + 2], once[ORDERS + 1];
    plain[0] = 1;
    for (int l = 1; l < ORDERS + 2; l++) plain[l] = plain[l - 1] * lobe->g;
    for (int l = 0; l < ORDERS + 1; l++)
        once[l] = ((l + 1.0) * plain[l + 1] + (l > 0 ? l * plain[l - 1] : 0)) / (2.0 * l + 1);
    const double size = 1 + lobe->alpha * (1 + 2 * lobe->g * lobe->g) / 3;
    for (int l = 0; l < ORDERS; l++) {
        const double twice = ((l + 1.0) * once[l + 1] + (l > 0 ? l * once[l - 1] : 0)) / (2.0 * l + 1);
        factors[l] += lobe->weight * (plain[l] + lobe->alpha * twice) / size;
    }
}

/* So much blur that what is left out does not matter. */
static void blur(double factors[ORDERS])
{
    const double left = fabs(factors[LAST]) / NEGLIGIBLE;
    if (left <= 1) return;
    const double half_square = log(left) / (LAST * (LAST + 1.0));
    for (int l = 0; l <= LAST; l++) factors[l] *= exp(-l * (l + 1.0) * half_square);
}

static nb_environment_filter *make_filter(const nebel_environment_map *map, const nb_phase *phase)
{
    double factors[ORDERS] = {0};
    for (int i = 0; i < phase->lobe_count; i++) add_lobe(&phase->lobes[i], factors);
    blur(factors);
    nb_environment_filter *filter = nb_environment_filter_create(&map->allocator, phase);
    recurrence *r = nb_allocate(&map->allocator, 1, sizeof *r);
    if (r != NULL) fill_recurrence(r);
    if (filter != NULL && (r == NULL || !fill_table(map, factors, r, &filter->table))) {
        nb_environment_filter_release(filter);
        filter = NULL;
    }
    nb_release(&map->allocator, r);
    return filter;
}

static void lock(nebel_environment_map *map)
{
    while (atomic_flag_test_and_set_explicit(&map->lock, memory_order_acquire)) continue;
}

static void unlock(nebel_environment_map *map)
{
    atomic_flag_clear_explicit(&map->lock, memory_order_release);
}

/* One more owner of the filter that the map has kept for a phase function, if it has one. */
static nb_environment_filter *find_filter(nebel_environment_map *map, const nb_phase *phase)
{
    nb_environment_filter *found = NULL;
    lock(map);
    for (int i = 0; i < MOST_FILTERS && found == NULL; i++)
        if (map->filters[i] != NULL && nb_phase_compare(&map->filters[i]->phase, phase) == 0) found = map->filters[i];
    if (found != NULL) atomic_fetch_add_explicit(&found->owners, 1, memory_order_relaxed);
    unlock(map);
    return found;
}

/* In place of the one that was kept first, where there are many. */
static void keep_filter(nebel_environment_map *map, nb_environment_filter *filter)
{
    atomic_fetch_add_explicit(&filter->owners, 1, memory_order_relaxed);
    lock(map);
    nb_environment_filter *replaced = map->filters[map->next_filter];
    map->filters[map->next_filter] = filter;
    map->next_filter = (map->next_filter + 1) % MOST_FILTERS;
    unlock(map);
    nb_environment_filter_release(replaced);
}

nb_environment_filter *nb_environment_map_filter(nebel_environment_map *map, const nb_phase *phase)
{
    nb_environment_filter *filter = find_filter(map, phase);
    if (filter != NULL) return filter;
    filter = make_filter(map, phase);
    if (filter != NULL) keep_filter(map, filter);
    return filter;
}

/* ---- lookups --------------------------------------------------------------------------------- */

/* Longitude from the left edge and colatitude, in parts of the whole. */
typedef struct sky_place {
    double across, down;
} sky_place;

/* The middle of the picture is -z, x to the right, as in a panorama of a camera that looks there. */
static sky_place map_place(const double direction[3])
{
    const double across = 0.5 + atan2(direction[0], -direction[2]) / (2 * PI);
    return (sky_place){across, acos(fmin(fmax(direction[1], -1), 1)) / PI};
}

static void spline_weights(double x, double weights[4])
{
    const double y = 1 - x;
    weights[0] = y * y * y / 6;
    weights[1] = (4 + x * x * (3 * x - 6)) / 6;
    weights[2] = (4 + y * y * (3 * y - 6)) / 6;
    weights[3] = x * x * x / 6;
}

/* A row beyond a pole is the one as far on the other side, half way round. */
static const float *row_beyond(const nb_environment_table *table, ptrdiff_t row, size_t *turn)
{
    const ptrdiff_t rows = (ptrdiff_t)table->rows;
    const ptrdiff_t inside = row < 0 ? -1 - row : row >= rows ? 2 * rows - 1 - row : row;
    *turn = inside == row ? 0 : table->rows;
    return &table->coefficients[3 * (size_t)inside * table->columns];
}

void nb_environment_map_scattered(const nb_environment_table *table, const double direction[3], double radiance[3])
{
    const sky_place place = map_place(direction);
    const double x = place.across * (double)table->columns - 0.5, y = place.down * (double)table->rows - 0.5;
    const double left = floor(x), top = floor(y);
    double across[4], down[4], sum[3] = {0, 0, 0};
    spline_weights(x - left, across);
    spline_weights(y - top, down);
    for (int i = 0; i < 4; i++) {
        size_t turn;
        const float *row = row_beyond(table, (ptrdiff_t)top - 1 + i, &turn);
        for (int j = 0; j < 4; j++) {
            const size_t column =
                ((size_t)((ptrdiff_t)left - 1 + j + (ptrdiff_t)table->columns) + turn) & (table->columns - 1);
            for (int c = 0; c < 3; c++) sum[c] += down[i] * across[j] * (double)row[3 * column + (size_t)c];
        }
    }
    for (int c = 0; c < 3; c++) radiance[c] = fmax(sum[c], 0);
}

void nb_environment_map_reflected(const nebel_environment_map *map, const double normal[3], double radiance[3])
{
    nb_environment_map_scattered(&map->reflected, normal, radiance);
}

void nb_environment_map_radiance(const nebel_environment_map *map, const double direction[3], double radiance[3])
{
    const sky_place place = map_place(direction);
    const double x = place.across * (double)map->width + (double)map->width - 0.5;
    const double y = fmin(fmax(place.down * (double)map->height - 0.5, 0), (double)map->height - 1);
    const size_t left = (size_t)x, upper = (size_t)y, lower = upper + 1 < map->height ? upper + 1 : upper;
    const double right_share = x - (double)left, lower_share = y - (double)upper;
    const float *rows[2] = {&map->pixels[3 * upper * map->width], &map->pixels[3 * lower * map->width]};
    const size_t a = 3 * (left % map->width), b = 3 * ((left + 1) % map->width);
    for (size_t c = 0; c < 3; c++) {
        const double over = (1 - right_share) * (double)rows[0][a + c] + right_share * (double)rows[0][b + c];
        const double under = (1 - right_share) * (double)rows[1][a + c] + right_share * (double)rows[1][b + c];
        radiance[c] = (1 - lower_share) * over + lower_share * under;
    }
}

const nb_environment_table *nb_environment_map_reflection(const nebel_environment_map *map)
{
    return &map->reflected;
}

const float *nb_environment_map_pixels(const nebel_environment_map *map, size_t *width, size_t *height)
{
    *width = map->width;
    *height = map->height;
    return map->pixels;
}

void nb_environment_map_most(const nebel_environment_map *map, double most[3])
{
    memcpy(most, map->most, sizeof map->most);
}

/* ---- making ---------------------------------------------------------------------------------- */

static nebel_result check_desc(const nebel_environment_map_desc *desc)
{
    if (!nb_allocator_is_valid(&desc->host.allocator))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT,
                       "environment map: the allocator needs both functions or neither");
    if (desc->pixels == NULL)
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "environment map: pixels must not be NULL");
    if (desc->width < 2 || desc->width > NEBEL_MAX_ENVIRONMENT_WIDTH)
        return nb_fail(&desc->host.log, NEBEL_ERROR_LIMIT, "environment map: is %zu pixels wide; must be 2 to %d",
                       desc->width, NEBEL_MAX_ENVIRONMENT_WIDTH);
    if (desc->width == 2 * desc->height) return NEBEL_OK;
    return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE,
                   "environment map: is %zu x %zu pixels; must be twice as wide as high, 360 by 180 degrees",
                   desc->width, desc->height);
}

static nebel_result copy_pixels(const nebel_environment_map_desc *desc, nebel_environment_map *map)
{
    for (size_t i = 0; i < 3 * map->width * map->height; i++) {
        const double value = (double)desc->pixels[i];
        if (!(value >= 0 && value <= NEBEL_MAX_AMOUNT))
            return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE,
                           "environment map: pixel %zu, %zu from the top left has %g; must be within 0 and %g",
                           i / 3 % map->width, i / 3 / map->width, value, NEBEL_MAX_AMOUNT);
        map->pixels[i] = desc->pixels[i];
        map->most[i % 3] = fmax(map->most[i % 3], value);
    }
    return NEBEL_OK;
}

static void free_map(nebel_environment_map *map)
{
    const nebel_allocator allocator = map->allocator;
    for (int i = 0; i < MOST_FILTERS; i++) nb_environment_filter_release(map->filters[i]);
    nb_release(&allocator, map->pixels);
    nb_release(&allocator, map->terms);
    nb_release(&allocator, map->reflected.coefficients);
    nb_release(&allocator, map);
}

/* 0 when memory is out. */
static int prepare(nebel_environment_map *map)
{
    double factors[ORDERS];
    recurrence *r = nb_allocate(&map->allocator, 1, sizeof *r);
    if (r == NULL) return 0;
    fill_recurrence(r);
    set_cosine_factors(factors);
    const int done = analyse(map, r) && fill_table(map, factors, r, &map->reflected);
    nb_release(&map->allocator, r);
    return done;
}

nebel_result nebel_create_environment_map(const nebel_environment_map_desc *desc, nebel_environment_map **map)
{
    if (map != NULL) *map = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    if (map == NULL)
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "environment map: the place for it must not be NULL");
    nebel_result result = check_desc(desc);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_environment_map *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "environment map: out of memory");
    made->allocator = allocator;
    atomic_init(&made->owners, 1);
    atomic_flag_clear(&made->lock);
    made->width = desc->width;
    made->height = desc->height;
    made->pixels = nb_allocate(&allocator, 3 * desc->width * desc->height, sizeof *made->pixels);
    made->terms = nb_allocate_zero(&allocator, TERMS, sizeof *made->terms);
    const int got = made->pixels != NULL && made->terms != NULL;
    result = got ? copy_pixels(desc, made) : NEBEL_ERROR_MEMORY;
    if (result == NEBEL_OK && !prepare(made)) result = NEBEL_ERROR_MEMORY;
    if (result == NEBEL_ERROR_MEMORY) (void)nb_fail(&desc->host.log, result, "environment map: out of memory");
    if (result != NEBEL_OK)
        free_map(made);
    else
        *map = made;
    return result;
}

nebel_environment_map *nebel_retain_environment_map(nebel_environment_map *map)
{
    if (map != NULL) atomic_fetch_add_explicit(&map->owners, 1, memory_order_relaxed);
    return map;
}

void nebel_release_environment_map(nebel_environment_map *map)
{
    if (map == NULL) return;
    if (atomic_fetch_sub_explicit(&map->owners, 1, memory_order_acq_rel) == 1) free_map(map);
}

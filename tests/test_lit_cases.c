/* Lit fog of which most light comes from a small part of the ray: the light is right within the error that is told. */
#include "unit.h"

#include "fog_help.h"
#include "lit_cases.h"

static nebel_lighting *commit_case(const lit_case *c)
{
    const size_t light_count = c->point_light.intensity[0] > 0 ? 1 : 0;
    const nebel_lighting_desc lights = {.sun = c->sun, .lights = &c->point_light, .light_count = light_count};
    return fog_light(&lights, &c->volume, 1);
}

static void light_of_small_places_is_within_the_error(void **state)
{
    (void)state;
    int wrong = 0;
    for (size_t i = 0; i < LIT_CASES; i++) {
        const lit_case *c = &lit_cases[i];
        nebel_lighting *lighting = commit_case(c);
        for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
            nebel_transfer transfer;
            const nebel_trace_desc desc = {.precision = (nebel_precision)precision, .tolerance = c->tolerance};
            fog_trace(lighting, desc, 1, &c->ray, &transfer);
            const double off = fabs(transfer.in_scattering[0] - c->right), digits = 5e-6 * c->right;
            if (off <= transfer.error + digits) continue;
            print_message("%s, %s: %g for %g, error %g\n", c->name,
                          precision == NEBEL_PRECISION_DOUBLE ? "double" : "float", transfer.in_scattering[0], c->right,
                          transfer.error);
            wrong++;
        }
        nebel_release_lighting(lighting);
    }
    assert_int_equal(wrong, 0);
}

/* ---- company ---------------------------------------------------------------------------------- */

static const nebel_plane planes_0[] = {
    {{-0.6019122292230185, 0.70641446066004, 0.3723980103090799}, -3933.130050844351},
    {{0.6180058049291545, 0.44911307065434164, -0.6452644999078255}, 10374.086745836812},
    {{0.9868840750540148, -0.16121259756914724, 0.008385749208615385}, 12143.725679084851}};

static const nebel_plane planes_3[] = {
    {{-0.7319417039530307, -0.6810088156968273, -0.022098302141541022}, 10228.823842721611},
    {{-0.7119261773089917, -0.6823817537381625, -0.16588025870318596}, 3617.2294898924583},
    {{-0.2225507079275484, -0.9354361455457696, -0.27464595392508684}, 6173.331304086478},
    {{0.43456713028943955, -0.8081140402643243, 0.397621814290503}, 13169.464145744561},
    {{-0.8751209289517665, -0.41453324645959444, 0.24965085077016308}, 11241.707395133402},
    {{0.7059770151286706, 0.06795854930307244, -0.7049667294891545}, -646.5139820886004},
    {{0.8491536159757787, 0.05926773284988622, -0.5248099392333326}, 49.44430955847042},
    {{0.07948430579581449, -0.9639564630483899, 0.2539097920116424}, 12352.246787373497},
    {{-0.15323093523636494, -0.4352486073722591, 0.8871746898255708}, 11290.229918539884},
    {{0.48165175940201943, -0.6690080844725824, -0.5660739930214647}, 3784.923760257284},
    {{0.29934809215885555, 0.12050181286560586, 0.946504111357661}, 4391.852028335893}};

/* Ends in doubt far behind a piece without fog in which another ray meets some. */
static const nebel_volume_desc company[] = {
    {.shape = {.type = NEBEL_SHAPE_CONVEX,
               .transform = {{533.9538365255491, 2632.921608722052, 4912.009959575787},
                             {-1.7576960493810674, -0.42196044214902256, -0.5396679859746363, -0.5002377662750219},
                             {1.5889055438760378, -0.3429584097245145, 1.9205660049353908}},
               .planes = planes_0,
               .plane_count = 3},
     .density = {.type = NEBEL_DENSITY_ALTITUDE,
                 .below = NEBEL_BELOW_GROW,
                 .scale_height = 514.2348727172418,
                 .radius = 143674.00585586138,
                 .center = {0, -143674.00585586138, 0}},
     .operation = NEBEL_OPERATION_REPLACE,
     .extinction = {6.997716916451196e-06, 8.559650989154329e-06, 8.795457244224052e-06},
     .albedo = {0.20337031077949674, 0.26928637103997655, 0.6402138398805727},
     .phase = {.type = NEBEL_PHASE_RAYLEIGH}},
    {.shape = {.type = NEBEL_SHAPE_SPHERE,
               .center = {2769.76625990605, 4847.21361751872, 8310.013006289175},
               .radius = 7220.423591952927},
     .density = {.type = NEBEL_DENSITY_GAUSSIAN,
                 .center = {5964.9932092641575, 213.9452055727098, -5626.720715831686},
                 .sigma = 4346.849525289967},
     .priority = -3,
     .extinction = {0.00013884447775570322, 0.00013884447775570322, 0.00013884447775570322},
     .albedo = {0.37381652541781174, 0.28676088897460117, 0.6534464196401785},
     .emission = {3.8069212331213965e-06, 9.296995968588531e-05, 6.888389196839683e-05}},
    {.shape = {.type = NEBEL_SHAPE_BOX,
               .transform = {{-3795.3597868893885, -4194.781519644123, -4483.480282143499},
                             {-0.5565789982321736, -0.0841330809747899, -0.08400153790409645, 1.8740406565833634},
                             {2.1934585406837384, -0.9954124598483944, -2.800267056213436}},
               .min = {-10000, -10000, 0},
               .max = {10000, 10000, 20000}},
     .extinction = {1.2961531756043843e-06, 9.313629408263463e-07, 1.0327395957162077e-06}},
    {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = planes_3, .plane_count = 11},
     .priority = 1,
     .extinction = {0.0005980100383277415, 0.0005980100383277415, 0.0005980100383277415},
     .albedo = {0.5119207657032396, 0.9508476350068125, 0.795565786496648}}};

static void compare_with_alone(const nebel_lighting *lighting, const nebel_ray rays[2])
{
    for (int isa = NEBEL_ISA_DEFAULT; isa < NEBEL_ISA_COUNT; isa++) {
        if (!nebel_isa_available((nebel_isa)isa)) continue;
        const nebel_trace_desc asked = {.precision = NEBEL_PRECISION_FLOAT, .isa = (nebel_isa)isa};
        nebel_transfer both[2], alone[2];
        fog_trace(lighting, asked, 2, rays, both);
        for (int i = 0; i < 2; i++) fog_trace(lighting, asked, 1, &rays[i], &alone[i]);
        assert_memory_equal(both, alone, sizeof both);
    }
}

static void an_error_is_the_same_in_any_company(void **state)
{
    (void)state;
    const nebel_lighting_desc lights = {.sun = {{0.5703836956029522, 0.7341352143446351, 0.28227282113884566},
                                                {3.798747974940091, 5.701761832261121, 3.004591232939652}}};
    const nebel_ray rays[] = {{{-7027.572529043353, 13281.28243056264, 3670.531089885469},
                               {-1388.2683006868756, -24713.766115851984, -17996.825625834386},
                               10000000.0},
                              {{-12370.996091612718, -1214.2372285642632, -2837.3831879135823},
                               {12987.905803801903, 9356.483849675022, 8053.4140760037235},
                               10000000.0}};
    nebel_lighting *lighting = fog_light(&lights, company, sizeof company / sizeof company[0]);
    compare_with_alone(lighting, rays);
    nebel_release_lighting(lighting);
}

/* One ray of two is in the voxels. */
static void an_error_is_the_same_beside_voxels(void **state)
{
    (void)state;
    static const float voxels[] = {0.826f, 0.834f, 0.357f, 0.324f, 0.657f, 0.172f, 0.119f, 0.228f};
    const nebel_grid_desc of_grid = {.size = {4, 2, 1}, .voxels = voxels, .filter = NEBEL_GRID_FILTER_LINEAR};
    nebel_grid *grid = NULL;
    assert_int_equal(nebel_create_grid(&of_grid, &grid), NEBEL_OK);
    const nebel_volume_desc fog[] = {
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-0.64, -0.074, -1.215}, .max = {0.1025, 0.291, -0.8564}},
         .density = {.type = NEBEL_DENSITY_GRID, .grid = grid},
         .extinction = {0.001, 0.00114, 0.0015},
         .albedo = {0.28, 0.91, 0.9}},
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0.0231, -0.5634, -1.068}, .radius = 0.7712},
         .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = 0.378},
         .extinction = {1.75, 1.32, 1.97},
         .albedo = {0.88, 0.88, 0.88}}};
    const nebel_lighting_desc lights = {.sun = {{0.5718, 0.799, 0.186}, {1.466, 1.466, 1.466}}};
    const nebel_ray rays[] = {{{-0.7321759, -0.6259578, -0.9529993}, {0.17222105, 0.9078012, -0.38240934}, 1.0403034},
                              {{0.0097677520, -0.2111334, -0.4915024}, {0.15538425, 0.4294096, -0.8896421}, 2.0793005}};
    nebel_lighting *lighting = fog_light(&lights, fog, 2);
    compare_with_alone(lighting, rays);
    nebel_release_lighting(lighting);
    nebel_release_grid(grid);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(light_of_small_places_is_within_the_error),
                                       cmocka_unit_test(an_error_is_the_same_in_any_company),
                                       cmocka_unit_test(an_error_is_the_same_beside_voxels)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}

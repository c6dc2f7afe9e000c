/* Fog by name in scene files: what it fills in, what replaces it, and how it is saved. */
#define _POSIX_C_SOURCE 200809L

#include "scene_draft.h"

#include <math.h>

#define HAZE BOX ", \"preset\": \"haze\""

/* In a file whose unit is 2 m. */
static void test_other_keys_replace_it(void **state)
{
    (void)state;
    const nebel_fog_preset *const haze = nebel_lookup_fog_preset("haze");
    draft d = open_draft(SCENE("\"unit\": 2, \"fog\": [{" HAZE "}, {" HAZE ", \"visibility\": 50}, {" HAZE
                               ", \"albedo\": 0.5}, {" HAZE ", \"phase\": {\"type\": \"rayleigh\"}}, {" HAZE
                               ", \"source\": 3}, {" HAZE ", \"mean_free_path\": 5}]"));
    const nebel_volume_desc *const fog = d.volumes;
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < 5; i++) {
            const double wanted = i == 1 ? nebel_extinction_from_visibility(100, 0) : haze->extinction[c];
            assert_true(fabs(fog[i].extinction[c] / wanted - 1) < 1e-15);
            assert_true(fog[i].albedo[c] == (i == 2 ? .5 : i == 4 ? 0 : haze->albedo[c]));
        }
        assert_true(fog[5].extinction[c] == .1 && fog[5].albedo[c] == haze->albedo[c] && fog[4].source[c] == 3);
    }
    for (int i = 0; i < 6; i++)
        assert_int_equal(fog[i].phase.type, i == 3   ? NEBEL_PHASE_RAYLEIGH
                                            : i == 4 ? NEBEL_PHASE_ISOTROPIC
                                                     : NEBEL_PHASE_HENYEY_GREENSTEIN);
    nebel_destroy_scene(d.scene);
}

/* An albedo moves where the preset has one. */
static void test_it_moves(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"fog\": [{" BOX ", \"preset\": \"smoke\", \"keys\": [{\"frame\": 0}, {\"frame\": 10, "
                               "\"extinction\": 1, \"albedo\": 0.25}]}]"));
    const nebel_fog_preset *const smoke = nebel_lookup_fog_preset("smoke");
    const nebel_volume_desc first = nebel_get_scene_volume(d.scene, 0, 0),
                            last = nebel_get_scene_volume(d.scene, 0, 10);
    for (int c = 0; c < 3; c++) {
        assert_true(first.extinction[c] == smoke->extinction[c] && first.albedo[c] == smoke->albedo[c]);
        assert_true(last.extinction[c] == 1 && last.albedo[c] == .25);
    }
    assert_true(last.phase.type == smoke->phase.type && last.phase.g == smoke->phase.g);
    nebel_destroy_scene(d.scene);
}

/* What a preset gave is written where it is another number now; the preset stays for the rest. */
static void test_it_is_saved(void **state)
{
    (void)state;
    static const char text[] = SCENE("\"unit\": 2, \"fog\": [{" BOX ", \"preset\": \"mist\"}, {" BOX
                                     ", \"preset\": \"haze\", \"source\": 1}, {" BOX ", \"preset\": \"smoke\"}]");
    draft d = open_draft(text);
    nebel_volume_track entries[3];
    for (int c = 0; c < 3; c++)
        assert_true(fabs(d.volumes[0].extinction[c] - nebel_lookup_fog_preset("mist")->extinction[c]) < 1e-18);
    assert_int_equal(d.volumes[0].phase.type, NEBEL_PHASE_DROPLETS);
    assert_true(d.volumes[1].albedo[0] == 0 && d.volumes[1].phase.type == NEBEL_PHASE_ISOTROPIC);
    assert_true(d.volumes[2].albedo[1] == nebel_lookup_fog_preset("smoke")->albedo[1]);
    d.volumes[0].priority = 3;
    check_saved(&d, SCENE("\"unit\": 2, \"fog\": [{" BOX ", \"preset\": \"mist\", \"priority\": 3}, {" BOX
                          ", \"preset\": \"haze\", \"source\": 1}, {" BOX ", \"preset\": \"smoke\"}]"));
    d = open_draft(text);
    for (int i = 0; i < 3; i++) entries[i] = d.data.volume_tracks[i];
    entries[2].contrast = .02;
    d.entries = entries;
    for (int c = 0; c < 3; c++) {
        d.volumes[0].extinction[c] = .5;
        d.volumes[0].albedo[c] = 0;
        d.volumes[1].albedo[c] = .5;
        d.volumes[1].source[c] = 0;
        d.volumes[2].extinction[c] = nebel_extinction_from_visibility(40, .02);
    }
    d.volumes[2].phase = (nebel_phase){.type = NEBEL_PHASE_ISOTROPIC};
    check_saved(&d,
                SCENE("\"unit\": 2, \"fog\": [{" BOX ", \"preset\": \"mist\", \"albedo\": 0, \"extinction\": 1}, {" BOX
                      ", \"preset\": \"haze\", \"albedo\": 0.5, \"phase\": { \"type\": "
                      "\"isotropic\" }}, {" BOX ", \"preset\": \"smoke\", \"phase\": { \"type\": "
                      "\"isotropic\" }, \"visibility\": 20, \"contrast\": 0.02}]"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_other_keys_replace_it),
        cmocka_unit_test(test_it_moves),
        cmocka_unit_test(test_it_is_saved),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}

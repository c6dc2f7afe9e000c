/* Every rule of the scene file, broken once. The mark ` stands where the message must point. */
#include "scene_help.h"

#define SCENE(members) "{\"nebel\": 1, \"fog\": [], " members "}"
#define FOG(volume) "{\"nebel\": 1, \"fog\": [\n {\"name\": \"d\u00fcnn\", " volume "}]}"
#define WORLD "\"shape\": {\"type\": \"world\"}"
#define SHAPE(members) FOG("\"extinction\": 1, \"shape\": {" members "}")
#define DENSITY(members) FOG(WORLD ", \"extinction\": 1, \"density\": {" members "}")
#define CAMERA(members) SCENE("\"camera\": {" members "}")
#define MODEL(members) SCENE("\"models\": [{" members "}]")
#define NEBULA(members)                                                                                                \
    SCENE("\"nebula\": [{\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 5}, " members "}]")
#define POINTS(rest) SCENE("\"nebula\": [{\"points\": {\"file\": " rest "}]")
#define BAD_LIGHT(members) SCENE("\"lights\": [{" members "}]")

static void test_what_no_scene_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, "`{\"fog\": []}", "the key \"nebel\" is missing; a scene needs it"},
        {FORMAT, "`{\"nebel\": 1}", "the key \"fog\" is missing; a scene needs it"},
        {UNSUPPORTED, "{\"nebel\": `2, \"fog\": []}", "nebel: is 2; this program reads version 1"},
        {FORMAT, "{\"nebel\": `\"1\", \"fog\": []}", "nebel: is a string; must be a number"},
        {FORMAT, "{\"nebel\": 1, \"fog\": `{}}", "fog: is an object; must be an array"},
        {FORMAT, "{\"nebel\": 1, \"fog\": [], `\"fog\": []}",
         "fog: the key appears twice, first at line 1, column 14; remove one"},
        {FORMAT, "{\"nebel\": 1, \"fog\": [], `\"f\\u006fg\": []}",
         "fog: the key appears twice, first at line 1, column 14; remove"},
        {FORMAT, SCENE("`\"ambiant\": 0"),
         "ambiant: unknown key; a scene has: nebel, up, unit, camera, background, sun, ambient, max_opacity, lights, "
         "models, fog, "
         "nebula, cells, classic, multiple_scattering, planet; did "
         "you "
         "mean "
         "\"ambient\"?"},
        {FORMAT, SCENE("`\"planets\": {}"), "planets: unknown key"},
        {FORMAT, "{\"camera\": {\"position\": [0, `-1.1e-3, 0]}, \"unit\": 1e18}",
         "camera.position[1]: is -0.0011; must be"},
        {FORMAT, "{\"camera\": {}, \"unit\": `0}", "unit: is 0; must be a number of metres from 1e-9 to 1e18"},
        {FORMAT, "{\"camera\": {}, \"unit\": 2, `\"unit\": 3}", "unit: the key appears twice"},
        {FORMAT, "{\"up\": `\"x\"}", "up: unknown; must be one of: y, z"},
        {FORMAT, "{\"up\": \"y\", `\"up\": \"y\"}", "up: the key appears twice"},
        {FORMAT, "{\"unit\": `0}", "unit: is 0; must be a number of metres from 1e-9 to 1e18"},
        {FORMAT, "{\"unit\": `2e18}", "unit: is 2e+18; must be"},
        {FORMAT, "{\"unit\": 1e18, \"camera\": {\"position\": [0, `-1.1e-3, 0]}}",
         "camera.position[1]: is -0.0011; must be a coordinate from -0.001 to 0.001 units of 1e18 m"},
        {FORMAT, SCENE("\"camera\": {\"position\": [`1.1e15, 0, 0], \"look_at\": [0, 0, 0]}"),
         "camera.position[0]: is 1.1e+15; must be a coordinate from -1e15 to 1e15 m"},
        {FORMAT, "{\"unit\": 1e18, \"camera\": {\"look_at\": [`1e300, 0, 0], \"position\": [0, 0, 0]}}",
         "camera.look_at[0]: is 1e+300; must be a coordinate from -0.001 to 0.001 units of 1e18 m"},
        {FORMAT, "{\"unit\": 1e18, \"models\": [{\"file\": \"a\", \"position\": [`1e300, 0, 0]}]}",
         "models[0].position[0]: is 1e+300; must be a coordinate from"},
        {FORMAT, "{\"unit\": 1e-9, \"fog\": [{\"shape\": {\"type\": \"world\"}, \"extinction\": `1e300}]}",
         "fog[0].extinction: is 1e+300; must be an amount from 0 to 1 per unit of 1e-9 m"},
        {FORMAT, SCENE("\"nebula\": `{}"), "nebula: is an object; must be an array"},
        {FORMAT, SCENE("\"background\": [0, `-1, 0]"), "background[1]: is -1; must be a number from 0 to 1e9"},
        {FORMAT, SCENE("\"background\": `[0, 1]"), "background: has 2 elements; must be an array of 3 numbers"},
        {FORMAT, SCENE("\"background\": `\"red\""),
         "background: is no color; \"#\" and 6 hexadecimal digits, as in \"#ffcc88\", or 3 of them, are sRGB"},
        {FORMAT, SCENE("\"background\": `\"#ffcc8\""), "background: is no color"},
        {FORMAT, SCENE("\"background\": `\"#ffcc8g\""), "background: is no color"},
        {FORMAT, SCENE("\"background\": `\"\""), "background: is no color"},
        {FORMAT, SCENE("\"background\": `\"ffcc88a\""), "background: is no color"},
        {FORMAT, SCENE("\"background\": `true"),
         "background: is true or false; must be a number, an array of 3 numbers [r, g, b], or \"#rrggbb\""},
        {FORMAT, SCENE("\"background\": `1e999"), "background: the number is too large; at most 1.797e308"},
        {FORMAT, SCENE("\"ambient\": `-0.1"), "ambient: is -0.1; must be a number from 0 to 1e9"},
        {FORMAT, SCENE("\"ambient\": [0, 0, `null]"), "ambient[2]: is null; must be a number from 0 to 1e9"},
        {FORMAT, SCENE("\"ambient\": `1.1e9"), "ambient: is 1100000000; must be a number from 0 to 1e9"},
        {FORMAT, SCENE("\"sun\": {\"direction\": `[0, 0, 0], \"irradiance\": 1}"), "sun.direction: has no direction"},
        {FORMAT, SCENE("\"sun\": {\"direction\": [0, 1, 0], \"irradiance\": `-1}"), "sun.irradiance: is -1; must be"},
        {FORMAT, SCENE("\"sun\": `{\"direction\": [0, 1, 0]}"),
         "sun: the key \"irradiance\" is missing; a sun needs it"},
        {FORMAT, SCENE("\"sun\": {`\"angle\": 1}"), "sun.angle: unknown key; a sun has: direction, irradiance"},
        {FORMAT, SCENE("\"sun\": {\"direction\": [0, 1, 0], \"irradiance\": 1, `\"irradiance\": 1}"),
         "sun.irradiance: the key appears twice"},
        {FORMAT, SCENE("\"sun\": `true"), "sun: is true or false; must be an object"},
    };
    CHECK(rules);
}

static void test_what_no_camera_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, CAMERA("\"vertical_fov\": `0"),
         "camera.vertical_fov: is 0; must be a number of degrees, > 0 and < 180"},
        {FORMAT, CAMERA("\"vertical_fov\": `180"), "camera.vertical_fov: is 180; must be"},
        {FORMAT, CAMERA("\"view_height\": `0"), "camera.view_height: is 0; must be a length from 1e-15 to 1e15 m"},
        {FORMAT, CAMERA("\"projection\": `\"fisheye\""),
         "camera.projection: unknown; must be one of: perspective, orthographic, panorama"},
        {FORMAT, CAMERA("\"projection\": `\"ortographic\""),
         "camera.projection: unknown; must be one of: perspective, orthographic, panorama; did you mean "
         "\"orthographic\"?"},
        {FORMAT, CAMERA("\"projection\": `1"), "camera.projection: is a number; must be a string"},
        {FORMAT, CAMERA("\"position\": [1, 2, 3], \"look_at\": `[1, 2, 3]"),
         "camera.look_at: the camera looks at its own"},
        {FORMAT, CAMERA("\"position\": [0, 9, 0], \"look_at\": `[0, 0, 0]"),
         "camera.look_at: the view is along \"up\""},
        {FORMAT, CAMERA("\"look_at\": [0, 1.7, 5], \"up\": `[0, 0, 2]"), "camera.up: the view is along \"up\""},
        {FORMAT, CAMERA("\"up\": `[0, 0, 0]"), "camera.up: has no direction"},
        {FORMAT, CAMERA("\"turntable\": {\"frames\": `0}"),
         "camera.turntable.frames: is 0; must be a whole number from 1 to"},
        {FORMAT, CAMERA("\"turntable\": {\"frames\": `2.5}"),
         "camera.turntable.frames: is 2.5; must be a whole number"},
        {FORMAT, CAMERA("\"turntable\": `{}"), "camera.turntable: the key \"frames\" is missing"},
        {FORMAT, CAMERA("\"turntable\": {\"frames\": 9}, `\"keys\": [{\"frame\": 0}]"), "camera.keys: a camera has"},
        {FORMAT, CAMERA("\"keys\": `[]"), "camera.keys: holds no key"},
        {FORMAT, CAMERA("\"keys\": [{\"frame\": 1}, `{\"frame\": 1}]"),
         "camera.keys[1]: its frame 1 is not after the key before it, 1; frames must ascend"},
        {FORMAT, CAMERA("\"keys\": [`{}]"), "camera.keys[0]: the key \"frame\" is missing"},
        {FORMAT, CAMERA("\"keys\": [{\"frame\": 1, `\"projection\": \"panorama\"}]"),
         "camera.keys[0].projection: unknown key"},
        {FORMAT, CAMERA("`\"frame\": 1"), "camera.frame: unknown key"},
        {FORMAT, CAMERA("\"keys\": [{\"frame\": 1, \"vertical_fov\": `200}]"), "camera.keys[0].vertical_fov: is 200"},
    };
    CHECK(rules);
}

#define POINT "\"type\": \"point\", \"position\": [0, 3, 0], \"intensity\": [5, 4, 3]"
#define SPOT "\"type\": \"spot\", \"position\": [0, 3, 0], \"intensity\": 5, \"direction\": [0, -1, 0], "

static void test_lights_are_checked(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, BAD_LIGHT(POINT ", \"radius\": `1e-4"), "lights[0].radius: is 0.0001; must be a length from 0.001 to"},
        {FORMAT, BAD_LIGHT(SPOT "\"inner_angle\": `31, \"outer_angle\": 30"), "lights[0].inner_angle: is 31; must be"},
        {FORMAT, BAD_LIGHT(SPOT "\"outer_angle\": `180.5"), "lights[0].outer_angle: is 180.5; must be"},
        {FORMAT, BAD_LIGHT(SPOT "\"outer_angle\": `0"),
         "lights[0].outer_angle: is 0; must be a number of degrees from the axis, > 0 and <= 180"},
        {FORMAT, BAD_LIGHT(POINT ", `\"direction\": [1, 0, 0]"), "lights[0].direction: unknown key; a point light has"},
        {FORMAT, BAD_LIGHT("\"type\": `\"sphere\", \"position\": [0, 3, 0]"),
         "lights[0].type: unknown; must be one of: point, spot; a ball that shines is a point with a \"radius\""},
        {FORMAT, BAD_LIGHT("\"type\": `\"laser\""), "lights[0].type: unknown; must be one of: point, spot"},
        {FORMAT, BAD_LIGHT("\"type\": \"point\", \"position\": [0, 3, 0], \"intensity\": `-1"),
         "lights[0].intensity: is -1"},
        {FORMAT, SCENE("\"lights\": [`{}]"), "lights[0]: the key \"type\" is missing; must be one of: point, spot"},
        {FORMAT, SCENE("\"lights\": [`1]"), "lights[0]: is a number; must be an object"},
        {FORMAT, SCENE("\"lights\": `0"), "lights: is a number; must be an array"},
    };
    CHECK(rules);
}

#define HEIGHTS "\"heightfield\": {\"file\": \"a.png\", \"size\": [2, 2], \"height\": 1}"

static void test_what_no_model_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, SCENE("\"models\": [`{}]"), "models[0]: is neither; a model has \"file\" or \"heightfield\""},
        {FORMAT, MODEL(HEIGHTS ", `\"file\": \"a\""), "models[0].file: does not go with \"heightfield\""},
        {FORMAT, MODEL(HEIGHTS ", `\"up\": \"z\""), "models[0].up: does not go with \"heightfield\""},
        {FORMAT, MODEL("\"file\": \"a\", \"unit\": `-1"), "models[0].unit: is -1; must be a number of metres"},
        {FORMAT, MODEL(HEIGHTS ", `\"scale\": 2"), "models[0].scale: does not go with \"heightfield\""},
        {FORMAT, MODEL("\"file\": `\"\""), "models[0].file: is empty; must be the path of a file"},
        {FORMAT, MODEL(HEIGHTS ", `\"folder\": \"a\""), "models[0].folder: does not go with \"heightfield\""},
        {FORMAT, MODEL("\"file\": \"a\", \"folder\": `\"\""),
         "models[0].folder: is empty; must be the path of a folder"},
        {FORMAT, MODEL("\"file\": `\"a\\u0000b\""), "models[0].file: holds a zero character"},
        {FORMAT, MODEL("\"file\": `7"), "models[0].file: is a number; must be a string"},
        {FORMAT, MODEL("\"file\": \"a\", \"scale\": `0"),
         "models[0].scale: is 0; must be a factor from 1e-9 to 1e9, or the negative of one"},
        {FORMAT, MODEL("\"file\": \"a\", \"scale\": [1, `0, 1]"), "models[0].scale[1]: is 0; must be a factor"},
        {FORMAT, MODEL("\"file\": \"a\", \"rotation\": `[0, 0, 0, 0]"),
         "models[0].rotation: a quaternion [x, y, z, w] of"},
        {FORMAT, MODEL("\"file\": \"a\", \"rotation\": `[0, 0, 1]"),
         "models[0].rotation: has 3 elements; must be an array of 4"},
        {FORMAT, MODEL("\"file\": \"a\", \"color\": [0, `1.5, 0]"),
         "models[0].color[1]: is 1.5; must be a number from 0 to 1"},
        {FORMAT, MODEL("\"heightfield\": {\"file\": \"a.png\", \"size\": [2, `0], \"height\": 1}"),
         "models[0].heightfield.size[1]: is 0; must be a length from 1e-15 to 1e15 m"},
        {FORMAT, MODEL("\"heightfield\": {\"file\": \"a.png\", \"size\": [2, 1], \"height\": `-1}"),
         "models[0].heightfield.height: is -1; must be a length from 1e-15 to 1e15 m"},
        {FORMAT, MODEL("\"heightfield\": `{\"file\": \"a.png\"}"),
         "models[0].heightfield: the key \"size\" is missing"},
        {FORMAT, SCENE("\"models\": [{\"file\": \"a\"}, {\"file\": \"b\", `\"colour\": 1}]"),
         "models[1].colour: unknown key; a model has: file, up, unit, position, rotation, scale, folder, heightfield, "
         "color; "
         "did you "
         "mean "
         "\"color\"?"},
    };
    CHECK(rules);
}

#define BOX "\"type\": \"box\", \"min\": [0, 0, 0], "
#define AXIS "\"from\": [1, 0, 0], "

static void test_what_no_shape_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, SHAPE("\"type\": `\"spheer\""),
         "fog[0].shape.type: unknown; must be one of: world, half_space, box, sphere, "
         "ellipsoid, cylinder, capsule, cone, convex, union, intersection; did you mean"},
        {FORMAT, FOG("\"extinction\": 1, \"shape\": `{}"),
         "fog[0].shape: the key \"type\" is missing; must be one of: world"},
        {FORMAT, FOG("\"extinction\": 1, \"shape\": `[]"), "fog[0].shape: is an array; must be an object"},
        {FORMAT, SHAPE(BOX "\"max\": [1, `0, 1]"),
         "fog[0].shape.max[1]: is 0; must be greater than min[1], which is 0"},
        {FORMAT, FOG("\"extinction\": 1, \"shape\": `{\"type\": \"box\", \"max\": [1, 1, 1]}"),
         "fog[0].shape: the key \"min\" is missing; a box needs it"},
        {FORMAT, SHAPE("\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": `0"),
         "fog[0].shape.radius: is 0; must be"},
        {FORMAT, SHAPE("\"type\": \"sphere\", `\"radii\": 1"),
         "fog[0].shape.radii: unknown key; a sphere has: type, transform, center, radius"},
        {FORMAT, SHAPE("\"type\": \"ellipsoid\", \"center\": [0, 0, 0], \"radii\": [1, 2, `-3]"),
         "fog[0].shape.radii[2]: is -3; must be a length from 1e-15 to 1e15 m"},
        {FORMAT, SHAPE("\"type\": \"ellipsoid\", \"center\": [0, 0, 0], \"radii\": `1"),
         "fog[0].shape.radii: is a number"},
        {FORMAT, SHAPE("\"type\": \"half_space\", \"point\": [0, 0, 0], \"normal\": `[0, 0, 0]"),
         "fog[0].shape.normal: has no direction"},
        {FORMAT, SHAPE("\"type\": \"cylinder\", " AXIS "\"to\": `[1, 0, 0], \"radius\": 1"),
         "fog[0].shape.to: is the same place as \"from\""},
        {FORMAT, SHAPE("\"type\": \"cone\", " AXIS "\"to\": [2, 0, 0], \"radius_from\": 0, \"radius_to\": `0"),
         "fog[0].shape.radius_to: both radii are 0; one must be > 0"},
        {FORMAT, SHAPE("\"type\": \"cone\", " AXIS "\"to\": [2, 0, 0], \"radius_from\": `-1, \"radius_to\": 0"),
         "fog[0].shape.radius_from: is -1; must be 0 or a length from 1e-15 to 1e15 m"},
        {FORMAT, SHAPE("\"type\": \"convex\", \"planes\": `[]"),
         "fog[0].shape.planes: holds 0 planes; must hold 1 to 1024"},
        {FORMAT, SHAPE("\"type\": \"convex\", \"planes\": [[1, 0, 0, 1], `[0, 0, 0, 1]]"),
         "fog[0].shape.planes[1]: has the normal 0; one of nx, ny, nz must not be 0"},
        {FORMAT, SHAPE("\"type\": \"convex\", \"planes\": [`[1, 0, 1]]"),
         "fog[0].shape.planes[0]: has 3 elements; must be"},
        {FORMAT, SHAPE("\"type\": \"union\", \"shapes\": `[]"),
         "fog[0].shape.shapes: holds 0 shapes; must hold 1 to 1024"},
        {FORMAT,
         SHAPE("\"type\": \"union\", \"shapes\": [{\"type\": \"world\"}, {\"type\": \"intersection\", \"shapes\": "
               "[{\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": `\"1\"}]}]"),
         "fog[0].shape.shapes[1].shapes[0].radius: is a string; must be a length from 1e-15 to 1e15 m"},
        {FORMAT, SHAPE("\"type\": \"world\", \"transform\": {\"scale\": `0}"),
         "fog[0].shape.transform.scale: is 0; must be a factor"},
        {FORMAT, SHAPE("\"type\": \"world\", \"transform\": {\"rotation\": `[0, 0, 0, 0]}"),
         "fog[0].shape.transform.rotation: a quaternion"},
        {FORMAT, SHAPE("\"type\": \"world\", \"transform\": {`\"translate\": 0}"),
         "fog[0].shape.transform.translate: unknown key; a transform has: position, rotation, scale"},
    };
    CHECK(rules);
}

static void test_what_no_density_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, DENSITY("\"type\": `\"grid\""),
         "fog[0].density.type: \"grid\" does not fit this shape; it needs a box"},
        {FORMAT, DENSITY("\"type\": `\"noise\""),
         "fog[0].density.type: \"noise\" does not fit this shape; it needs a box"},
        {FORMAT, DENSITY("\"type\": `\"radial\""),
         "fog[0].density.type: \"radial\" does not fit this shape; it needs a sphere"},
        {FORMAT, DENSITY("\"type\": `\"soft_edge\", \"distance\": 1"),
         "fog[0].density.type: \"soft_edge\" does not fit this shape; it needs a shape with a surface"},
        {FORMAT, DENSITY("\"type\": \"height\", \"scale_height\": `0"), "fog[0].density.scale_height: is 0; must be"},
        {FORMAT, DENSITY("\"type\": \"height\", \"scale_height\": 1, \"below\": `\"none\""),
         "fog[0].density.below: unknown; must be one of: grow, constant"},
        {FORMAT, DENSITY("\"type\": \"linear\", \"from\": [1, 2, 3], \"to\": `[1, 2, 3]"),
         "fog[0].density.to: is the same place"},
        {FORMAT, DENSITY("\"type\": \"altitude\", \"scale_height\": `40, \"radius\": 1900"),
         "fog[0].density.scale_height: is 40; must be at most a 50th of the distance of the base from the center, "
         "1900"},
        {FORMAT, DENSITY("\"type\": \"gaussian\", \"center\": [1, 2, 3], \"sigma\": `-1"),
         "fog[0].density.sigma: is -1"},
        {FORMAT,
         FOG("\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 1}, \"density\": {\"type\": "
             "\"radial\", \"power\": `4}"),
         "fog[0].density.power: is 4; must be a whole number from 1 to 3"},
        {FORMAT,
         FOG("\"shape\": {" BOX "\"max\": [1, 1, 1]}, \"density\": {\"type\": \"soft_edge\", \"distance\": `0}"),
         "fog[0].density.distance: is 0; must be a length from 1e-15 to 1e15 m"},
        {FORMAT, DENSITY("\"type\": \"constant\", `\"base\": 1"),
         "fog[0].density.base: unknown key; a constant density has: type"},
    };
    CHECK(rules);
}

#define LIT(members) FOG(WORLD ", \"extinction\": 1, " members)

static void test_what_no_volume_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, "{\"nebel\": 1, \"fog\": [`7]}", "fog[0]: is a number; must be a volume"},
        {FORMAT, "{\"nebel\": 1, \"fog\": [`{\"extinction\": 1}]}",
         "fog[0]: the key \"shape\" is missing; a volume needs it"},
        {FORMAT, "{\"nebel\": 1, \"fog\": [{" WORLD ", \"extinction\": 1}, `{" WORLD "}]}",
         "fog[1]: the amount is missing; give one of extinction, mean_free_path, visibility, or a preset"},
        {FORMAT, FOG(WORLD ", \"extinction\": 1, `\"visibility\": 2"), "fog[0].visibility: the amount is given twice"},
        {FORMAT, FOG(WORLD ", \"extinction\": [1, 1, `-1]"),
         "fog[0].extinction[2]: is -1; must be an amount from 0 to 1e9 per metre"},
        {FORMAT, FOG(WORLD ", \"mean_free_path\": `0"),
         "fog[0].mean_free_path: is 0; must be a length of at least 1e-9 m"},
        {FORMAT, FOG(WORLD ", \"mean_free_path\": `1e-300"),
         "fog[0].mean_free_path: is 1e-300; must be a length of at least 1e-9 m"},
        {FORMAT, FOG(WORLD ", \"visibility\": [1, `0, 1]"),
         "fog[0].visibility[1]: is 0; must be a length of at least 2.99573527e-9 m"},
        {FORMAT, FOG(WORLD ", \"visibility\": 1, \"contrast\": `1"),
         "fog[0].contrast: is 1; must be a number > 0 and < 1"},
        {FORMAT, FOG(WORLD ", \"visibility\": 1, \"contrast\": `0"),
         "fog[0].contrast: is 0; must be a number > 0 and < 1"},
        {FORMAT, FOG(WORLD ", \"extinction\": 1, `\"contrast\": 0.1"), "fog[0].contrast: belongs to \"visibility\""},
        {FORMAT, LIT("\"source\": 1, `\"albedo\": 1"),
         "fog[0].albedo: a volume has \"source\" or \"albedo\", not both"},
        {FORMAT, LIT("\"source\": `-1"), "fog[0].source: is -1; must be a number from 0 to 1e9"},
        {FORMAT, LIT("\"emission\": `-1"), "fog[0].emission: is -1; must be an amount from 0 to 1e9 per metre"},
        {FORMAT, LIT("\"albedo\": [0, `1.1, 0]"), "fog[0].albedo[1]: is 1.1; must be a number from 0 to 1"},
        {FORMAT, LIT("`\"phase\": {\"type\": \"rayleigh\"}"), "fog[0].phase: belongs to \"albedo\""},
        {FORMAT, LIT("\"preset\": `\"fog\""),
         "fog[0].preset: unknown; must be one of: heavy_advection, moderate_advection, heavy_radiation, "
         "moderate_radiation, mist, haze, smoke, black_smoke"},
        {FORMAT, LIT("\"preset\": `\"heavy_radiaton\""),
         "fog[0].preset: unknown; must be one of: heavy_advection, moderate_advection, heavy_radiation, "
         "moderate_radiation, mist, haze, smoke, black_smoke; did you mean \"heavy_radiation\"?"},
        {FORMAT, LIT("\"preset\": `1"), "fog[0].preset: is a number; must be a string"},
        {FORMAT, LIT("\"preset\": \"mist\", \"source\": 1, `\"phase\": {\"type\": \"rayleigh\"}"),
         "fog[0].phase: belongs to \"albedo\""},
        {FORMAT, FOG(WORLD ", \"preset\": \"mist\", `\"contrast\": 0.1"), "fog[0].contrast: belongs to \"visibility\""},
        {FORMAT, FOG(WORLD ", \"preset\": \"mist\", \"keys\": [{\"frame\": 0, `\"preset\": \"haze\"}]"),
         "fog[0].keys[0].preset: unknown key"},
        {FORMAT, FOG(WORLD ", \"preset\": \"mist\", \"keys\": [{\"frame\": 0, `\"source\": 1}]"),
         "fog[0].keys[0].source: does not go with the volume's \"albedo\""},
        {FORMAT, LIT("\"albedo\": 1, \"phase\": {\"type\": `\"mie\"}"),
         "fog[0].phase.type: unknown; must be one of: isotropic, "
         "henyey_greenstein, rayleigh, cornette_shanks, draine, droplets"},
        {FORMAT, LIT("\"albedo\": 1, \"phase\": {\"type\": \"henyey_greenstein\", \"g\": `1}"),
         "fog[0].phase.g: is 1; must be"},
        {FORMAT, LIT("\"albedo\": 1, \"phase\": {\"type\": \"cornette_shanks\", \"g\": `-1}"),
         "fog[0].phase.g: is -1; must be"},
        {FORMAT, LIT("\"albedo\": 1, \"phase\": `{\"type\": \"cornette_shanks\"}"),
         "fog[0].phase: the key \"g\" is missing"},
        {FORMAT, LIT("\"albedo\": 1, \"phase\": {\"type\": \"draine\", \"g\": 0, \"alpha\": `-1}"),
         "fog[0].phase.alpha: is -1; must be a number from 0 to 1e9"},
        {FORMAT, LIT("\"albedo\": 1, \"phase\": `{\"type\": \"draine\", \"g\": 0}"),
         "fog[0].phase: the key \"alpha\" is missing"},
        {FORMAT, LIT("\"albedo\": 1, \"phase\": {\"type\": \"droplets\", \"diameter\": `0}"),
         "fog[0].phase.diameter: is 0"},
        {FORMAT, LIT("\"albedo\": 1, \"phase\": {\"type\": \"rayleigh\", `\"g\": 0}"), "fog[0].phase.g: unknown key"},
        {FORMAT, LIT("\"operation\": `\"subtract\""),
         "fog[0].operation: unknown; must be one of: add, exclude, replace"},
        {FORMAT, LIT("\"start\": `-1"), "fog[0].start: is -1; must be a distance from 0 to 1e15 m"},
        {FORMAT, LIT("\"cutoff\": `0"), "fog[0].cutoff: is 0; must be more than \"start\", 0"},
        {FORMAT, LIT("\"start\": 5, \"cutoff\": `5"), "fog[0].cutoff: is 5; must be more than \"start\", 5"},
        {FORMAT, LIT("\"priority\": `0.5"),
         "fog[0].priority: is 0.5; must be a whole number from -2147483648 to 2147483647"},
        {FORMAT, FOG(WORLD ", \"operation\": \"exclude\", `\"extinction\": 1"),
         "fog[0].extinction: unknown key; a volume with \"operation\": \"exclude\" has: name, shape, operation, "
         "priority, start, cutoff, keys"},
        {FORMAT, LIT("`\"albdo\": 1"),
         "fog[0].albdo: unknown key; a volume has: name, shape, operation, priority, density, preset, "
         "extinction, mean_free_path, visibility, contrast, source, albedo, phase, emission, start, cutoff, keys; did "
         "you mean "
         "\"albedo\"?"},
        {FORMAT, FOG(WORLD ", \"extinction\": 1, `\"name\": 1"),
         "fog[0].name: the key appears twice, first at line 2, column 3; remove one"},
    };
    CHECK(rules);
}

static void test_what_only_the_core_knows_is_reported(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, SHAPE("\"type\": \"convex\", \"planes\": `[[1, 0, 0, -1], [-1, 0, 0, -1]]"),
         "fog[0].shape.planes: no point is inside all planes; the body is empty"},
        {FORMAT,
         SHAPE("\"type\": \"union\", \"shapes\": [{\"type\": \"world\"},\n{\"type\": \"convex\", \"planes\": "
               "`[[0, 1, 0, 0], [0, -1, 0, -1e-3]]}]"),
         "fog[0].shape.shapes[1].planes: no point is inside all planes"},
    };
    CHECK(rules);
}

#define SUN "\"sun\": {\"direction\": [0, 1, 0], \"irradiance\": [0, 2, 0]}"

static void test_nesting_has_a_limit(void **state)
{
    (void)state;
    char text[400] = "{\"nebel\": 1, \"fog\": ";
    for (int i = 0; i < 100; i++) strcat(text, i == 63 ? "`[" : "[");
    const rule deep = {LIMIT, text, "nested too deeply; at most 64 levels"};
    check_rules(&deep, 1);
}

static void test_numbers_have_a_longest_form(void **state)
{
    (void)state;
    char text[2000] = "{\"nebel\": `1.";
    memset(text + strlen(text), '0', 1200);
    strcat(text, ", \"fog\": []}");
    const rule lengthy = {LIMIT, text, "nebel: a number of 1202 characters; at most 1000"};
    check_rules(&lengthy, 1);
}

static void test_one_volume_has_a_limit_of_leaves(void **state)
{
    (void)state;
    char *text = malloc(100000), *at = text;
    at += sprintf(at, "{\"nebel\": 1, \"fog\": [{\"extinction\": 1, \"shape\": {\"type\": \"union\", \"shapes\": [");
    for (int i = 0; i < 2; i++) {
        at += sprintf(at, "%s{\"type\": \"union\", \"shapes\": [", i > 0 ? ", " : "");
        for (int k = 0; k < 513; k++)
            at += sprintf(at, "%s%s{\"type\": \"world\"}", k > 0 ? "," : "", i == 1 && k == 511 ? "`" : "");
        at += sprintf(at, "]}");
    }
    sprintf(at, "]}}]}");
    const rule many = {LIMIT, text,
                       "fog[0].shape.shapes[1].shapes[511]: one volume is made of too many shapes; at most 1024"};
    check_rules(&many, 1);
    free(text);
}

static void test_text_has_a_largest_size(void **state)
{
    (void)state;
    journal kept = {0};
    nebel_scene *scene;
    const nebel_scene_desc desc = {.host.log = {remember, &kept}};
    assert_int_equal(nebel_parse_scene("{}", ((size_t)1 << 30) + 1, "a.json", &desc, &scene), NEBEL_ERROR_LIMIT);
    assert_string_equal(kept.last, "a.json: larger than 1073741824 bytes, the most that is read");
}

static void test_strange_keys_are_shown_safely(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, SCENE("`\"a\\nb\\u001b[31m\": 0"), "a?b?[31m: unknown key"},
        {FORMAT, SCENE("`\"0123456789012345678901234567890123456789x\": 0"),
         "0123456789012345678901234567890123456789...: unknown"},
        {FORMAT, SCENE("`\"\": 0"), "unknown key"},
    };
    CHECK(rules);
}

static void test_what_no_nebula_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, SCENE("\"nebula\": [`{}]"), "nebula[0]: is nowhere; a nebula has \"shape\" or \"points\""},
        {FORMAT, SCENE("\"nebula\": [{\"shape\": `{\"type\": \"world\"}}]"), "nebula[0].shape: has no bounds"},
        {FORMAT, NEBULA("\"count\": `0"), "nebula[0].count: is 0; must be a whole number from 1 to 1000000"},
        {FORMAT, NEBULA("\"count\": `1e7"), "nebula[0].count: is 10000000; must be"},
        {FORMAT, NEBULA("\"seed\": `-1"), "nebula[0].seed: is -1; must be"},
        {FORMAT, NEBULA("\"profile\": `\"hard\""),
         "nebula[0].profile: unknown; must be one of: soft, gaussian, uniform"},
        {FORMAT, NEBULA("\"radius_range\": `[2, 1]"), "nebula[0].radius_range: is larger first"},
        {FORMAT, NEBULA("\"radius_range\": [`0, 1]"),
         "nebula[0].radius_range[0]: is 0; must be a length from 1e-15 to 1e15 m"},
        {FORMAT, NEBULA("\"absorption\": `-1"), "nebula[0].absorption: is -1; must be"},
        {FORMAT, NEBULA("\"absorption\": `\"#fff\""),
         "nebula[0].absorption: is a string; must be a number or an array"},
        {FORMAT, NEBULA("\"colors\": [`\"#ff\"]"), "nebula[0].colors[0]: is no color"},
        {FORMAT, NEBULA("\"colors\": `[]"), "nebula[0].colors: has 0 colors; 1 to 64 are possible"},
        {FORMAT, NEBULA("\"emission\": 1e5, \"colors\": [1, `1e5]"),
         "nebula[0].colors[1]: times the emission is 10000000000; that must be"},
        {FORMAT, NEBULA("\"colors\": [1, `-1]"), "nebula[0].colors[1]: is -1; must be"},
        {FORMAT, NEBULA("\"dimming\": `2"), "nebula[0].dimming: is 2; must be a number from 0 to 1"},
        {FORMAT, NEBULA("\"turbulence\": `-1"), "nebula[0].turbulence: is -1; must be"},
        {FORMAT, NEBULA("\"turbulence_scale\": `0"), "nebula[0].turbulence_scale: is 0; must be"},
        {FORMAT, NEBULA("`\"place\": 3"), "nebula[0].place: unknown key; a nebula has: name, shape, points"},
        {FORMAT, SCENE("\"nebula\": [{`\"shape\": {}, \"points\": {}}]"),
         "nebula[0].shape: does not go with \"points\""},
        {FORMAT, POINTS("\"a.ply\"}, `\"count\": 3"), "nebula[0].count: does not go with \"points\""},
        {FORMAT, POINTS("\"a.ply\"}, `\"density\": {\"type\": \"constant\"}"), "nebula[0].density: does not go with"},
        {FORMAT, POINTS("\"a.ply\", `\"color\": 1}"),
         "nebula[0].points.color: unknown key; a set of points has: file, up,"},
        {FORMAT, POINTS("\"a.ply\", \"scale\": `0}"), "nebula[0].points.scale: is 0; must be a factor"},
        {FORMAT, SCENE("\"nebula\": [{\"points\": `{}}]"), "nebula[0].points: the key \"file\" is missing"},
        {NEBEL_ERROR_FILE, POINTS("`\"there is none.ply\"}"),
         "nebula[0].points.file: cannot read the model \"dir/there is none.ply\""},
        {LIMIT,
         SCENE("\"nebula\": [{\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 5}, \"count\": "
               "1000000}, "
               "`{\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 5}, \"count\": 1}]"),
         "nebula[1]: brings the particles of this scene above 1000000"},
        {FORMAT, SCENE("\"nebula\": [{\"shape\": `{\"type\": \"convex\", \"planes\": [[1, 0, 0, 1]]}}]"),
         "nebula[0].shape: its shape has no bounds"},
    };
    CHECK(rules);
}

static void test_arguments_are_checked(void **state)
{
    (void)state;
    nebel_scene *scene = (nebel_scene *)state;
    const nebel_scene_desc half = {.host.allocator = {.allocate = metered_allocate}};
    assert_int_equal(nebel_parse_scene(NULL, 3, "a", &(nebel_scene_desc){0}, &scene), NEBEL_ERROR_ARGUMENT);
    assert_null(scene);
    assert_int_equal(nebel_parse_scene("{}", 2, NULL, &(nebel_scene_desc){0}, &scene), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_parse_scene("{}", 2, "a", NULL, &scene), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_parse_scene("{}", 2, "a", &(nebel_scene_desc){0}, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_parse_scene("{}", 2, "a", &half, &scene), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_parse_scene(NULL, 0, "a", &(nebel_scene_desc){0}, &scene), NEBEL_ERROR_FORMAT);
    nebel_destroy_scene(NULL);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_no_scene_has),
        cmocka_unit_test(test_what_no_camera_has),
        cmocka_unit_test(test_lights_are_checked),
        cmocka_unit_test(test_what_no_model_has),
        cmocka_unit_test(test_what_no_shape_has),
        cmocka_unit_test(test_what_no_density_has),
        cmocka_unit_test(test_what_no_volume_has),
        cmocka_unit_test(test_what_no_nebula_has),
        cmocka_unit_test(test_what_only_the_core_knows_is_reported),
        cmocka_unit_test(test_nesting_has_a_limit),
        cmocka_unit_test(test_numbers_have_a_longest_form),
        cmocka_unit_test(test_one_volume_has_a_limit_of_leaves),
        cmocka_unit_test(test_text_has_a_largest_size),
        cmocka_unit_test(test_strange_keys_are_shown_safely),
        cmocka_unit_test(test_arguments_are_checked),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}

#!/bin/bash
# Installs into a fresh prefix, builds a small program through pkg-config and another through find_package, runs both.
set -euo pipefail

work=$(mktemp -d "${TMPDIR:-/tmp}/nebel-install.XXXXXX")
trap 'rm -rf "$work"' EXIT
prefix=$work/prefix

cmake --install "$NEBEL_BUILD" --prefix "$prefix" >"$work/install.log"
library=$(dirname "$(find "$prefix" -name nebel.pc)")/..
library=$(cd "$library" && pwd)
export PKG_CONFIG_PATH=$library/pkgconfig LD_LIBRARY_PATH=$library

# What the headers point to.
sed -n 's/.*\(docs\/[a-z-]*\.md\).*/\1/p' "$prefix"/include/nebel/*.h | sort -u | while read -r page; do
    test -e "$(find "$prefix" -path "*/doc/nebel/$page")"
done

mkdir "$work/consumer"
cat >"$work/consumer/core.c" <<'C'
#include <math.h>
#include <nebel/nebel.h>
#include <stdio.h>

int main(void)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *now = NULL;
    const nebel_volume_desc sphere = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 1, -5}, .radius = 2},
                                      .extinction = {.5, .5, .5}, .source = {.7, .7, .8}};
    const nebel_ray ray = {.origin = {0, 1, 0}, .direction = {0, 0, -1}, .t_max = 100};
    nebel_transfer transfer;
    if (nebel_create_fog(&(nebel_fog_desc){0}, &fog) != NEBEL_OK || nebel_add_volume(fog, &sphere, NULL) != NEBEL_OK ||
        nebel_commit_fog(fog, &now) != NEBEL_OK ||
        nebel_trace(now, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer) != NEBEL_OK)
        return 1;
    nebel_release_snapshot(now);
    nebel_destroy_fog(fog);
    printf("nebel %s: transmittance %.6f\n", nebel_version(), transfer.transmittance[0]);
    return fabs(transfer.transmittance[0] - exp(-2.0)) < 1e-9 ? 0 : 1;
}
C
cat >"$work/consumer/layers.c" <<'C'
#include <nebel/render.h>
#include <stdio.h>

int main(void)
{
    printf("%s, %s\n", nebel_scene_libraries(), nebel_cpu_libraries());
    return 0;
}
C
cat >"$work/consumer/models.c" <<'C'
#include <nebel/scene.h>
#include <stdio.h>
#include <string.h>

/* A model is read by the program that the package names; without a name, and not installed where nebel was configured for,
 * it is an error. */
int main(int count, char **words)
{
    static const char text[] = "{\"nebel\": 1, \"fog\": [], \"models\": [{\"file\": \"quad.obj\"}]}";
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {.model_reader = count > 1 ? words[1] : READER};
    if (nebel_parse_scene(text, strlen(text), "scene.json", &desc, &scene) != NEBEL_OK) return 1;
    const nebel_result result = nebel_load_scene_models(scene);
    printf("%s: %zu meshes\n", nebel_result_text(result), nebel_get_scene_data(scene)->mesh_count);
    nebel_destroy_scene(scene);
    return result == (count > 1 ? NEBEL_ERROR_FILE : NEBEL_OK) ? 0 : 1;
}
C
printf 'v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n' >"$work/consumer/quad.obj"
echo '{"nebel": 1, "fog": [], "models": [{"file": "quad.obj"}]}' >"$work/consumer/scene.json"
cat >"$work/consumer/passes.c" <<'C'
#include <nebel/gl.h>
#include <stdio.h>

/* There is no context here, and nebel says so. */
int main(void)
{
    nebel_gl *gl = NULL;
    const nebel_result result = nebel_create_gl(&(nebel_gl_desc){0}, &gl);
    printf("without a context: %s\n", nebel_result_text(result));
    return result == NEBEL_ERROR_UNSUPPORTED && gl == NULL ? 0 : 1;
}
C
cat >"$work/consumer/CMakeLists.txt" <<'C'
cmake_minimum_required(VERSION 3.21)
project(consumer LANGUAGES C)
find_package(nebel 0.1 REQUIRED COMPONENTS scene cpu gl)
add_executable(core core.c)
target_link_libraries(core PRIVATE nebel::nebel m)
add_executable(layers layers.c)
target_link_libraries(layers PRIVATE nebel::cpu)
add_executable(models models.c)
target_link_libraries(models PRIVATE nebel::scene)
target_compile_definitions(models PRIVATE READER="${nebel_MODEL_READER}")
add_executable(passes passes.c)
target_link_libraries(passes PRIVATE nebel::gl)
C

cd "$work/consumer"
compiler=${CC:-cc}
read -ra core_flags < <(pkg-config --cflags --libs nebel)
read -ra layer_flags < <(pkg-config --cflags --libs nebel_cpu)
"$compiler" -std=c11 -o core core.c "${core_flags[@]}" -lm
read -ra pass_flags < <(pkg-config --cflags --libs nebel_gl)
"$compiler" -std=c11 -o layers layers.c "${layer_flags[@]}"
read -ra scene_flags < <(pkg-config --cflags --libs nebel_scene)
"$compiler" -std=c11 -DREADER="\"$(pkg-config --variable=model_reader nebel_scene)\"" -o models models.c "${scene_flags[@]}"
"$compiler" -std=c11 -o passes passes.c "${pass_flags[@]}"
./core
./layers
./models
./models "$prefix/nowhere"
./passes

cmake -S . -B build -DCMAKE_PREFIX_PATH="$prefix" >"$work/configure.log"
cmake --build build >"$work/build.log" || { cat "$work/build.log"; exit 1; }
build/core
build/layers
build/models
build/passes

# The program finds the reader beside it, and nothing else will do.
if [ -x "$NEBEL" ]; then
    "$prefix/bin/nebel" --help >/dev/null
    "$prefix/bin/nebel" info scene.json | grep -q "1 meshes, 2 triangles"
fi
echo "installed, built twice, run"

/* A Direct3D 9 device that draws into a picture of SIZE x SIZE floats without showing a window, for tests of fog:
 * lighting, culling, depth test and clipping are off. Every call that fails ends the test. Include after <cmocka.h>. */
#ifndef D3D9_DEVICE_H
#define D3D9_DEVICE_H

#include <nebel/classic.h>

#define COBJMACROS
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#include <d3d9.h>

#include <string.h>

enum { D3D9_SIZE = 64 };

/* Places are transformed with SetTransform, or already in pixels. */
typedef struct d3d9_vertex {
    float place[3];
    uint32_t diffuse, specular; /* D3DCOLOR: 0xAARRGGBB */
} d3d9_vertex;

typedef struct d3d9_pixel_vertex {
    float place[4]; /* pixels from the centre of the upper left one, depth, rhw */
    uint32_t diffuse, specular;
} d3d9_pixel_vertex;

enum { D3D9_VERTEX = D3DFVF_XYZ | D3DFVF_DIFFUSE | D3DFVF_SPECULAR };
enum { D3D9_PIXEL_VERTEX = D3DFVF_XYZRHW | D3DFVF_DIFFUSE | D3DFVF_SPECULAR };

typedef struct d3d9_device {
    HWND window;
    IDirect3D9 *system;
    IDirect3DDevice9 *device;
    IDirect3DSurface9 *target, *copy;
    IDirect3DVertexShader9 *with_fog, *without_fog; /* vs_1_1; oFog is constant 0 */
} d3d9_device;

/* Red, green, blue, alpha, by rows. */
typedef struct d3d9_picture {
    float pixels[D3D9_SIZE][D3D9_SIZE][4];
} d3d9_picture;

static inline void d3d9_require(HRESULT result, const char *what)
{
    if (FAILED(result)) fail_msg("%s: %lx\n", what, (unsigned long)result);
}

#define D3D9_REQUIRE(call) d3d9_require(call, #call)

/* ---- shaders --------------------------------------------------------------------------------- */

/* Tokens of vs_1_1: bit 31, the register's type (D3DSPR_...) from bit 28, write mask or swizzle from bit 16, its
 * number. */
#define D3D9_REGISTER(type, mask, number) (0x80000000u | (DWORD)(type) << 28 | (mask) << 16 | (number))
#define D3D9_POSITION D3D9_REGISTER(D3DSPR_INPUT, 0xe4u, 0u)
#define D3D9_COLOR D3D9_REGISTER(D3DSPR_INPUT, 0xe4u, 1u)
#define D3D9_BEGIN                                                                                                     \
    D3DVS_VERSION(1, 1), D3DSIO_DCL, 0x80000000u | D3DDECLUSAGE_POSITION, D3D9_REGISTER(D3DSPR_INPUT, 0xfu, 0u),       \
        D3DSIO_DCL, 0x80000000u | D3DDECLUSAGE_COLOR, D3D9_REGISTER(D3DSPR_INPUT, 0xfu, 1u), D3DSIO_MOV,               \
        D3D9_REGISTER(D3DSPR_RASTOUT, 0xfu, D3DSRO_POSITION), D3D9_POSITION, D3DSIO_MOV,                               \
        D3D9_REGISTER(D3DSPR_ATTROUT, 0xfu, 0u), D3D9_COLOR
#define D3D9_FOG_IS_CONSTANT                                                                                           \
    D3DSIO_MOV, D3D9_REGISTER(D3DSPR_RASTOUT, 0xfu, D3DSRO_FOG), D3D9_REGISTER(D3DSPR_CONST, 0u, 0u)
#define D3D9_END 0xffffu

/* ---- the device ------------------------------------------------------------------------------ */

static inline void d3d9_set_states(IDirect3DDevice9 *device)
{
    static const DWORD states[][2] = {
        {D3DRS_LIGHTING, FALSE}, {D3DRS_CULLMODE, D3DCULL_NONE}, {D3DRS_ZENABLE, D3DZB_FALSE}, {D3DRS_CLIPPING, FALSE}};
    for (size_t i = 0; i < sizeof states / sizeof *states; i++)
        D3D9_REQUIRE(IDirect3DDevice9_SetRenderState(device, (D3DRENDERSTATETYPE)states[i][0], states[i][1]));
}

static inline void d3d9_open(d3d9_device *d, D3DFORMAT format)
{
    memset(d, 0, sizeof *d);
    d->window = CreateWindowA("static", "nebel", WS_POPUP, 0, 0, D3D9_SIZE, D3D9_SIZE, NULL, NULL, NULL, NULL);
    assert_non_null(d->window);
    d->system = Direct3DCreate9(D3D_SDK_VERSION);
    assert_non_null(d->system);
    D3DPRESENT_PARAMETERS present = {.BackBufferWidth = D3D9_SIZE,
                                     .BackBufferHeight = D3D9_SIZE,
                                     .BackBufferFormat = D3DFMT_A8R8G8B8,
                                     .SwapEffect = D3DSWAPEFFECT_DISCARD,
                                     .hDeviceWindow = d->window,
                                     .Windowed = TRUE};
    D3D9_REQUIRE(IDirect3D9_CreateDevice(d->system, D3DADAPTER_DEFAULT, D3DDEVTYPE_HAL, d->window,
                                         D3DCREATE_SOFTWARE_VERTEXPROCESSING, &present, &d->device));
    D3D9_REQUIRE(IDirect3DDevice9_CreateRenderTarget(d->device, D3D9_SIZE, D3D9_SIZE, format, D3DMULTISAMPLE_NONE, 0,
                                                     FALSE, &d->target, NULL));
    D3D9_REQUIRE(IDirect3DDevice9_CreateOffscreenPlainSurface(d->device, D3D9_SIZE, D3D9_SIZE, format,
                                                              D3DPOOL_SYSTEMMEM, &d->copy, NULL));
    D3D9_REQUIRE(IDirect3DDevice9_SetRenderTarget(d->device, 0, d->target));
    const DWORD with_fog[] = {D3D9_BEGIN, D3D9_FOG_IS_CONSTANT, D3D9_END}, without_fog[] = {D3D9_BEGIN, D3D9_END};
    D3D9_REQUIRE(IDirect3DDevice9_CreateVertexShader(d->device, with_fog, &d->with_fog));
    D3D9_REQUIRE(IDirect3DDevice9_CreateVertexShader(d->device, without_fog, &d->without_fog));
    d3d9_set_states(d->device);
}

static inline void d3d9_close(d3d9_device *d)
{
    IDirect3DVertexShader9_Release(d->without_fog);
    IDirect3DVertexShader9_Release(d->with_fog);
    IDirect3DSurface9_Release(d->copy);
    IDirect3DSurface9_Release(d->target);
    IDirect3DDevice9_Release(d->device);
    IDirect3D9_Release(d->system);
    DestroyWindow(d->window);
}

static inline void d3d9_set_fog(const d3d9_device *d, const nebel_d3d9_fog *fog)
{
    static const uint32_t states[] = {NEBEL_D3DRS_FOGENABLE,      NEBEL_D3DRS_FOGCOLOR,     NEBEL_D3DRS_FOGTABLEMODE,
                                      NEBEL_D3DRS_FOGSTART,       NEBEL_D3DRS_FOGEND,       NEBEL_D3DRS_FOGDENSITY,
                                      NEBEL_D3DRS_RANGEFOGENABLE, NEBEL_D3DRS_FOGVERTEXMODE};
    for (size_t i = 0; i < sizeof states / sizeof *states; i++) {
        uint32_t value;
        assert_int_equal(nebel_get_d3d9_state(fog, states[i], &value), NEBEL_OK);
        D3D9_REQUIRE(IDirect3DDevice9_SetRenderState(d->device, (D3DRENDERSTATETYPE)states[i], value));
    }
}

static inline void d3d9_set_matrix(const d3d9_device *d, D3DTRANSFORMSTATETYPE which, const float m[16])
{
    D3DMATRIX matrix;
    memcpy(&matrix, m, sizeof matrix);
    D3D9_REQUIRE(IDirect3DDevice9_SetTransform(d->device, which, &matrix));
}

/* Clears to black and draws a triangle strip. */
static inline void d3d9_draw(const d3d9_device *d, DWORD format, size_t vertex_size, const void *vertices, size_t count)
{
    D3D9_REQUIRE(IDirect3DDevice9_Clear(d->device, 0, NULL, D3DCLEAR_TARGET, 0, 1, 0));
    D3D9_REQUIRE(IDirect3DDevice9_SetFVF(d->device, format));
    D3D9_REQUIRE(IDirect3DDevice9_BeginScene(d->device));
    D3D9_REQUIRE(
        IDirect3DDevice9_DrawPrimitiveUP(d->device, D3DPT_TRIANGLESTRIP, (UINT)count - 2, vertices, (UINT)vertex_size));
    D3D9_REQUIRE(IDirect3DDevice9_EndScene(d->device));
}

/* ---- pictures -------------------------------------------------------------------------------- */

static inline void d3d9_read_row(D3DFORMAT format, const void *from, float (*row)[4])
{
    const uint32_t *const colors = from;
    if (format == D3DFMT_A32B32G32R32F) {
        memcpy(row, from, D3D9_SIZE * sizeof *row);
        return;
    }
    for (int x = 0; x < D3D9_SIZE; x++)
        for (int c = 0; c < 4; c++) row[x][c] = (float)(colors[x] >> (c < 3 ? 16 - 8 * c : 24) & 255) / 255;
}

/* Of a target in A32B32G32R32F or A8R8G8B8. */
static inline void d3d9_read(const d3d9_device *d, d3d9_picture *picture)
{
    D3DLOCKED_RECT locked;
    D3DSURFACE_DESC desc;
    D3D9_REQUIRE(IDirect3DSurface9_GetDesc(d->copy, &desc));
    D3D9_REQUIRE(IDirect3DDevice9_GetRenderTargetData(d->device, d->target, d->copy));
    D3D9_REQUIRE(IDirect3DSurface9_LockRect(d->copy, &locked, NULL, D3DLOCK_READONLY));
    for (int y = 0; y < D3D9_SIZE; y++)
        d3d9_read_row(desc.Format, (const char *)locked.pBits + y * locked.Pitch, picture->pixels[y]);
    D3D9_REQUIRE(IDirect3DSurface9_UnlockRect(d->copy));
}

#endif

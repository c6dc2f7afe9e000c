/* A small engine of Direct3D 9 with a landscape of vertices. It stands for yours in d3d9_specular.c. */
#ifndef ENGINE_D3D9_H
#define ENGINE_D3D9_H

#define COBJMACROS
#define WIN32_LEAN_AND_MEAN
#include <windows.h>
#include <d3d9.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { WIDTH = 640, HEIGHT = 400, SIDE = 192, VERTICES = SIDE * SIDE, CELLS = (SIDE - 1) * (SIDE - 1) };

/* D3DFVF_XYZ, DIFFUSE, SPECULAR. */
typedef struct engine_vertex {
    float place[3];
    uint32_t diffuse, specular;
} engine_vertex;

typedef struct engine {
    HWND window;
    IDirect3D9 *system;
    IDirect3DDevice9 *device;
    engine_vertex vertices[VERTICES];
    uint16_t indices[6 * CELLS];
    double view[16];
    float projection[16];
} engine;

/* Hills of some metres, 28 m across. */
static inline double engine_height(double x, double z)
{
    return 1.1 * sin(.55 * x + 1) * cos(.5 * z) + .35 * sin(1.3 * x) * sin(1.6 * z + 2) + .12 * cos(3.1 * x + 2 * z);
}

/* Grass below, stone above, lit from one side. */
static inline uint32_t engine_color(double x, double y, double z)
{
    const double slope[2] = {(engine_height(x + .01, z) - y) / .01, (engine_height(x, z + .01) - y) / .01};
    const double light =
        fmax(.5 - .6 * slope[0] + .4 * slope[1], 0) / sqrt(1 + slope[0] * slope[0] + slope[1] * slope[1]);
    const double stone = fmin(fmax(y - .2, 0), 1), bright = fmin(.3 + light, 1.1);
    const double low[3] = {60, 110, 40}, high[3] = {150, 140, 130};
    uint32_t color = 0xff;
    for (int c = 0; c < 3; c++)
        color = color << 8 | (uint32_t)fmin((low[c] + (high[c] - low[c]) * stone) * bright, 255);
    return color;
}

static inline void engine_make_landscape(engine *e)
{
    uint16_t *index = e->indices;
    for (int i = 0; i < VERTICES; i++) {
        const double x = 28. * (i % SIDE) / (SIDE - 1) - 14, z = 28. * (i / SIDE) / (SIDE - 1) - 14;
        const double y = engine_height(x, z);
        e->vertices[i] = (engine_vertex){{(float)x, (float)y, (float)z}, engine_color(x, y, z), 0};
        if (i % SIDE == SIDE - 1 || i / SIDE == SIDE - 1) continue;
        const int corners[6] = {i, i + 1, i + SIDE, i + SIDE, i + 1, i + SIDE + 1};
        for (int k = 0; k < 6; k++) *index++ = (uint16_t)corners[k];
    }
}

/* 0 where there is no device. */
static inline int engine_open(engine *e, const char *title, int visible)
{
    const DWORD style = WS_CAPTION | WS_SYSMENU | (visible ? WS_VISIBLE : 0);
    RECT area = {0, 0, WIDTH, HEIGHT};
    AdjustWindowRect(&area, style, FALSE);
    e->window = CreateWindowA("static", title, style, CW_USEDEFAULT, CW_USEDEFAULT, area.right - area.left,
                              area.bottom - area.top, NULL, NULL, NULL, NULL);
    e->system = Direct3DCreate9(D3D_SDK_VERSION);
    D3DPRESENT_PARAMETERS how = {.BackBufferWidth = WIDTH,
                                 .BackBufferHeight = HEIGHT,
                                 .BackBufferFormat = D3DFMT_X8R8G8B8,
                                 .SwapEffect = D3DSWAPEFFECT_DISCARD,
                                 .hDeviceWindow = e->window,
                                 .Windowed = TRUE,
                                 .EnableAutoDepthStencil = TRUE,
                                 .AutoDepthStencilFormat = D3DFMT_D24S8};
    if (!e->window || !e->system ||
        FAILED(IDirect3D9_CreateDevice(e->system, D3DADAPTER_DEFAULT, D3DDEVTYPE_HAL, e->window,
                                       D3DCREATE_SOFTWARE_VERTEXPROCESSING, &how, &e->device)))
        return 0;
    IDirect3DDevice9_SetRenderState(e->device, D3DRS_LIGHTING, FALSE);
    IDirect3DDevice9_SetRenderState(e->device, D3DRS_CULLMODE, D3DCULL_NONE);
    engine_make_landscape(e);
    return 1;
}

/* Stands 12 m from the middle and looks at it; a left-handed camera as D3DXMatrixLookAtLH makes it. */
static inline void engine_turn(engine *e, double angle)
{
    const double eye[3] = {12 * sin(angle), 6.5, -12 * cos(angle)}, length = sqrt(144 + 6.5 * 6.5);
    const double ahead[3] = {-eye[0] / length, -eye[1] / length, -eye[2] / length};
    const double right[3] = {cos(angle), 0, sin(angle)};
    const double up[3] = {ahead[1] * right[2] - ahead[2] * right[1], ahead[2] * right[0] - ahead[0] * right[2],
                          ahead[0] * right[1] - ahead[1] * right[0]};
    const double *const axes[3] = {right, up, ahead};
    memset(e->view, 0, sizeof e->view);
    e->view[15] = 1;
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) {
            e->view[4 * i + k] = axes[k][i];
            e->view[12 + k] -= axes[k][i] * eye[i];
        }
    const float projection[16] = {1.5f * HEIGHT / WIDTH, 0, 0, 0, 0, 1.5f, 0, 0, 0, 0, 1.002f, 1, 0, 0, -.1f, 0};
    memcpy(e->projection, projection, sizeof projection);
}

static inline void engine_draw(const engine *e, uint32_t sky)
{
    D3DMATRIX view, projection;
    for (int i = 0; i < 16; i++) view.m[i / 4][i % 4] = (float)e->view[i];
    memcpy(&projection, e->projection, sizeof projection);
    IDirect3DDevice9_SetTransform(e->device, D3DTS_VIEW, &view);
    IDirect3DDevice9_SetTransform(e->device, D3DTS_PROJECTION, &projection);
    IDirect3DDevice9_Clear(e->device, 0, NULL, D3DCLEAR_TARGET | D3DCLEAR_ZBUFFER, sky, 1, 0);
    IDirect3DDevice9_SetFVF(e->device, D3DFVF_XYZ | D3DFVF_DIFFUSE | D3DFVF_SPECULAR);
    IDirect3DDevice9_BeginScene(e->device);
    IDirect3DDevice9_DrawIndexedPrimitiveUP(e->device, D3DPT_TRIANGLELIST, 0, VERTICES, 2 * CELLS, e->indices,
                                            D3DFMT_INDEX16, e->vertices, sizeof *e->vertices);
    IDirect3DDevice9_EndScene(e->device);
}

/* The frame that was drawn last as a PPM; 1 where it is written. */
static inline int engine_save(const engine *e, const char *path)
{
    IDirect3DSurface9 *target = NULL, *copy = NULL;
    D3DLOCKED_RECT rows = {0};
    FILE *const file = fopen(path, "wb");
    int written = file != NULL && SUCCEEDED(IDirect3DDevice9_GetRenderTarget(e->device, 0, &target)) &&
                  SUCCEEDED(IDirect3DDevice9_CreateOffscreenPlainSurface(e->device, WIDTH, HEIGHT, D3DFMT_X8R8G8B8,
                                                                         D3DPOOL_SYSTEMMEM, &copy, NULL)) &&
                  SUCCEEDED(IDirect3DDevice9_GetRenderTargetData(e->device, target, copy)) &&
                  SUCCEEDED(IDirect3DSurface9_LockRect(copy, &rows, NULL, D3DLOCK_READONLY));
    if (written) fprintf(file, "P6 %d %d 255\n", WIDTH, HEIGHT);
    for (int i = 0; written && i < WIDTH * HEIGHT; i++) {
        const unsigned char *bgra = (const unsigned char *)rows.pBits + i / WIDTH * rows.Pitch + i % WIDTH * 4;
        const unsigned char rgb[3] = {bgra[2], bgra[1], bgra[0]};
        written = fwrite(rgb, sizeof rgb, 1, file) == 1;
    }
    if (copy) IDirect3DSurface9_Release(copy);
    if (target) IDirect3DSurface9_Release(target);
    if (file) written = fclose(file) == 0 && written;
    return written;
}

/* Shows the frame; 0 when the window was closed or Escape pressed. */
static inline int engine_show(const engine *e)
{
    MSG message;
    IDirect3DDevice9_Present(e->device, NULL, NULL, NULL, NULL);
    while (PeekMessageA(&message, NULL, 0, 0, PM_REMOVE)) DispatchMessageA(&message);
    return IsWindow(e->window) && !(GetAsyncKeyState(VK_ESCAPE) & 0x8000);
}

static inline void engine_close(engine *e)
{
    if (e->device) IDirect3DDevice9_Release(e->device);
    if (e->system) IDirect3D9_Release(e->system);
    if (e->window) DestroyWindow(e->window);
}

#endif

// Compiles and draws fog in WebGL 2. check_web.py puts `input` in front: {text, sets: [{name, defines, calls}], pictures: [...]}
// with what web_case.c writes of each picture. The answer is the text of the page, as JSON.

const vertexText = `#version 300 es
void main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }`;

const pictureCalls = `
uniform highp sampler2D distances;
layout(location = 0) out vec4 transmittance;
layout(location = 1) out vec4 inScattering;
void main()
{
    nebel_view_ray sight = nebel_make_view_ray(gl_FragCoord.xy, texelFetch(distances, ivec2(gl_FragCoord.xy), 0).x);
    nebel_transfer fog = nebel_trace(sight.origin, sight.direction, sight.t_max);
    transmittance = vec4(fog.transmittance, 1.0);
    inScattering = vec4(fog.in_scattering, 1.0);
}`;

const sources = '#define NEBEL_FOG_TEXTURE\n#define NEBEL_VOXELS\n#define NEBEL_DIFFUSION\n#define NEBEL_ENVIRONMENT\n';

const gl = document.createElement('canvas').getContext('webgl2');

function compile(kind, text) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (gl.getShaderParameter(shader, gl.COMPILE_STATUS)) return shader;
    throw new Error(gl.getShaderInfoLog(shader) || 'the shader does not compile, without a message');
}

function build(defines, calls) {
    const program = gl.createProgram();
    const fragmentText = '#version 300 es\n#define NEBEL_VIEW\n' + defines + input.text + calls;
    const shaders = [compile(gl.VERTEX_SHADER, vertexText), compile(gl.FRAGMENT_SHADER, fragmentText)];
    for (const shader of shaders) gl.attachShader(program, shader);
    gl.linkProgram(program);
    for (const shader of shaders) gl.deleteShader(shader);
    if (gl.getProgramParameter(program, gl.LINK_STATUS)) return program;
    throw new Error(gl.getProgramInfoLog(program) || 'the program does not link, without a message');
}

function fillTexture(program, unit, name, width, data, internal, format, type) {
    const rows = Math.max(1, Math.ceil(data.length / 4 / width));
    const padded = new data.constructor(4 * width * rows);
    padded.set(data);
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texImage2D(gl.TEXTURE_2D, 0, internal, width, rows, 0, format, type, padded);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    gl.uniform1i(gl.getUniformLocation(program, name), unit);
}

function addTarget(attachment, width, height) {
    gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
    gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, width, height);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, null, 0);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, attachment, gl.TEXTURE_2D, gl.getParameter(gl.TEXTURE_BINDING_2D), 0);
}

function readTarget(attachment, width, height) {
    const pixels = new Float32Array(4 * width * height);
    gl.readBuffer(attachment);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, pixels);
    return Array.from(pixels);
}

function draw({features, width, height, fog, voxels, nodes, environment, rays, pixels}) {
    if (!gl.getExtension('EXT_color_buffer_float')) throw new Error('WebGL 2 here has no float targets');
    const plain = `#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES ${features}\n#define NEBEL_DEPTH_ENCODING 3\n`;
    const program = build(sources + plain, pictureCalls);
    const fillFloats = (unit, name, words, columns) =>
        fillTexture(program, unit, name, columns, new Float32Array(words), gl.RGBA32F, gl.RGBA, gl.FLOAT);
    gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
    gl.activeTexture(gl.TEXTURE7);
    addTarget(gl.COLOR_ATTACHMENT0, width, height);
    addTarget(gl.COLOR_ATTACHMENT1, width, height);
    gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
    gl.viewport(0, 0, width, height);
    gl.useProgram(program);
    fillFloats(0, 'nebel_fog_texture', fog, 1024);
    fillFloats(1, 'nebel_diffusion_texture', nodes, 1024);
    fillFloats(2, 'nebel_environment_texture', environment, 1024);
    fillFloats(3, 'distances', pixels.flatMap(([, distance]) => [distance, 0, 0, 0]), width);
    fillTexture(program, 4, 'nebel_voxel_texture', 1024, new Uint32Array(voxels), gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT);
    gl.uniform4fv(gl.getUniformLocation(program, 'nebel_rays'), rays);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const answer = {
        transmittance: readTarget(gl.COLOR_ATTACHMENT0, width, height),
        inScattering: readTarget(gl.COLOR_ATTACHMENT1, width, height),
    };
    const error = gl.getError();
    if (error) throw new Error(`WebGL error ${error}`);
    return answer;
}

function attempt(work) {
    try {
        if (!gl) throw new Error('no WebGL 2 here');
        const start = performance.now();
        const answer = work() || {};
        answer.seconds = (performance.now() - start) / 1000;
        return answer;
    } catch (error) {
        return {fault: String(error.message)};
    }
}

// A program is deleted before the next is made: all together they would need more memory than one process may have.
function tryToBuild(defines, calls) {
    gl.deleteProgram(build(defines, calls));
}

const output = {
    driver: gl ? gl.getParameter(gl.getExtension('WEBGL_debug_renderer_info').UNMASKED_RENDERER_WEBGL) : 'none',
    sets: input.sets.map(({defines, calls}) => attempt(() => tryToBuild(sources + defines, calls))),
    pictures: input.pictures.map(picture => attempt(() => draw(picture))),
};
document.body.textContent = JSON.stringify(output);

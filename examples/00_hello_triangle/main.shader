#if VERTEX_SHADER

layout(location = 0) in vec2 in_position;
layout(location = 1) in vec4 in_color;

layout(binding = 0) uniform Parameters {
    vec2 scale;
    vec2 rotation;
};

layout(location = 0) out vec4 s_color;

void main() {
    vec2 position = mat2(rotation.x, rotation.y, -rotation.y, rotation.x) * in_position;
    gl_Position = vec4(position * scale, 0.0, 1.0);
    s_color = in_color;
}

#elif FRAGMENT_SHADER

layout(location = 0) in vec4 s_color;

layout(location = 0) out vec4 out_color;

void main() { out_color = s_color; }

#endif

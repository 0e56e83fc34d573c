#include "common/panel.h"

#include <imgui.h>

#include <cstddef>
#include <span>

using namespace glint;

namespace {

constexpr const char* shader = R"(
#if VERTEX_SHADER

layout(location = 0) in vec2 in_position;
layout(location = 1) in vec2 in_texcoord;
layout(location = 2) in vec4 in_color;

layout(push_constant) uniform Push { vec2 size; };

layout(location = 0) out vec2 s_texcoord;
layout(location = 1) out vec4 s_color;

void main() {
    gl_Position = vec4(in_position / size * vec2(2.0, -2.0) + vec2(-1.0, 1.0), 0.0, 1.0);
    s_texcoord = in_texcoord;
    s_color = in_color;
}

#else

layout(binding = 0) uniform sampler2D font;

layout(location = 0) in vec2 s_texcoord;
layout(location = 1) in vec4 s_color;

layout(location = 0) out vec4 out_color;

void main() { out_color = s_color * texture(font, s_texcoord); }

#endif
)";

/// Which of our keys is which of the panel's.
constexpr struct {
    ImGuiKey_ theirs;
    int ours;
} keys[] = {
    {ImGuiKey_Tab, Window::KeyTab},
    {ImGuiKey_LeftArrow, Window::KeyLeft},
    {ImGuiKey_RightArrow, Window::KeyRight},
    {ImGuiKey_UpArrow, Window::KeyUp},
    {ImGuiKey_DownArrow, Window::KeyDown},
    {ImGuiKey_PageUp, Window::KeyPageUp},
    {ImGuiKey_PageDown, Window::KeyPageDown},
    {ImGuiKey_Home, Window::KeyHome},
    {ImGuiKey_End, Window::KeyEnd},
    {ImGuiKey_Insert, Window::KeyInsert},
    {ImGuiKey_Delete, Window::KeyDelete},
    {ImGuiKey_Backspace, Window::KeyBackspace},
    {ImGuiKey_Space, Window::KeySpace},
    {ImGuiKey_Enter, Window::KeyEnter},
    {ImGuiKey_Escape, Window::KeyEscape},
    {ImGuiKey_A, 'A'},
    {ImGuiKey_C, 'C'},
    {ImGuiKey_V, 'V'},
    {ImGuiKey_X, 'X'},
    {ImGuiKey_Y, 'Y'},
    {ImGuiKey_Z, 'Z'},
};

void passEvents(const Window& window, double seconds) {
    ImGuiIO& io = ImGui::GetIO();
    io.DisplaySize = {static_cast<float>(window.getWidth()), static_cast<float>(window.getHeight())};
    io.DeltaTime = std::max(static_cast<float>(seconds), 1e-5f);
    io.MousePos = {window.getMouse().x, window.getMouse().y};
    for (int i = 0; i < Window::ButtonCount; i++) {
        const auto button = static_cast<Window::Button>(i);
        // A click shorter than a frame counts, too.
        io.MouseDown[i] = window.isMouseDown(button) || window.isMousePressed(button);
    }
    io.MouseWheelH += window.getWheel().x;
    io.MouseWheel += window.getWheel().y;
    for (int key = 0; key < Window::KeyCount; key++) io.KeysDown[key] = window.isKeyDown(key);
    io.KeyShift = window.isKeyDown(Window::KeyShift);
    io.KeyCtrl = window.isKeyDown(Window::KeyControl);
    io.KeyAlt = window.isKeyDown(Window::KeyAlt);
    io.KeySuper = window.isKeyDown(Window::KeySuper);
    io.AddInputCharactersUTF8(window.getText().c_str());
}

void showFigures(const Statistics& statistics, const PanelFigures& figures) {
    ImGui::TextUnformatted(statistics.adapter.c_str());
    ImGui::Text("%.1f frames a second%s", figures.frames_per_second, figures.is_paused ? ", paused" : "");
    for (const std::string& pass : statistics.passNames())
        ImGui::Text("%8.2f ms  %s", statistics.last(pass) * 1e-6, pass.c_str());
    for (const auto& [name, count] : statistics.counts)
        ImGui::Text("%11llu  %s", static_cast<unsigned long long>(count), name.c_str());
}

void showKnob(Knob& knob) {
    const char* name = knob.name.c_str();
    if (bool* const* flag = std::get_if<bool*>(&knob.value)) {
        ImGui::Checkbox(name, *flag);
    } else if (float* const* number = std::get_if<float*>(&knob.value)) {
        ImGui::SliderFloat(name, *number, knob.minimum, knob.maximum);
    } else {
        const auto minimum = static_cast<uint32_t>(knob.minimum), maximum = static_cast<uint32_t>(knob.maximum);
        ImGui::SliderScalar(name, ImGuiDataType_U32, std::get<uint32_t*>(knob.value), &minimum, &maximum, nullptr,
                            ImGuiSliderFlags_AlwaysClamp);
    }
    if (ImGui::IsItemHovered()) ImGui::SetTooltip("%s", knob.help.c_str());
}

}  // namespace

Panel::Panel(Device& device, Format format) {
    ImGui::CreateContext();
    ImGuiIO& io = ImGui::GetIO();
    io.IniFilename = nullptr;  // an example leaves no files behind
    io.BackendFlags |= ImGuiBackendFlags_RendererHasVtxOffset;
    for (const auto& key : keys) io.KeyMap[key.theirs] = key.ours;
    ImGui::StyleColorsDark();
    unsigned char* texels = nullptr;
    int width = 0, height = 0;
    io.Fonts->GetTexDataAsRGBA32(&texels, &width, &height);
    font_ =
        device.createTexture2D(FormatRGBAu8n, static_cast<uint32_t>(width), static_cast<uint32_t>(height), 0, "font");
    device.setTexture(font_, texels, static_cast<uint64_t>(width) * height * 4);
    sampler_ = device.createSampler(Sampler::FilterLinear);

    pipeline_ = device.createPipeline("panel");
    pipeline_.setColorFormat(format);
    pipeline_.addAttribute(Pipeline::AttributePosition, FormatRGf32, 0, offsetof(ImDrawVert, pos), sizeof(ImDrawVert));
    pipeline_.addAttribute(Pipeline::AttributeTexCoord, FormatRGf32, 0, offsetof(ImDrawVert, uv), sizeof(ImDrawVert));
    pipeline_.addAttribute(Pipeline::AttributeColor, FormatRGBAu8n, 0, offsetof(ImDrawVert, col), sizeof(ImDrawVert));
    pipeline_.setBlend(Pipeline::BlendOpAdd, Pipeline::BlendFuncSrcAlpha, Pipeline::BlendFuncInvSrcAlpha);
    // The window stays opaque.
    pipeline_.setBlendAlpha(0, Pipeline::BlendOpAdd, Pipeline::BlendFuncOne, Pipeline::BlendFuncInvSrcAlpha);
    pipeline_.createShaderGLSL(Shader::TypeVertex, shader, "VERTEX_SHADER=1");
    pipeline_.createShaderGLSL(Shader::TypeFragment, shader, "FRAGMENT_SHADER=1");
    (void)pipeline_.create();  // carried by the handle
}

Panel::~Panel() { ImGui::DestroyContext(); }

Error Panel::error() const {
    if (!pipeline_) return pipeline_.error();
    return font_ ? sampler_.error() : font_.error();
}

void Panel::update(const Window& window, Example& example, const PanelFigures& figures, double seconds) {
    passEvents(window, seconds);
    ImGui::NewFrame();
    ImGui::SetNextWindowPos({12.0f, 12.0f}, ImGuiCond_FirstUseEver);
    ImGui::SetNextWindowBgAlpha(0.75f);
    if (ImGui::Begin(example.name().c_str(), nullptr, ImGuiWindowFlags_AlwaysAutoResize)) {
        showFigures(example.statistics(), figures);
        if (!example.knobs().empty()) ImGui::Separator();
        for (Knob& knob : example.knobs()) showKnob(knob);
        ImGui::Separator();
        ImGui::TextDisabled("drag, wheel: look   Home: reset\nSpace: pause   Tab: panel   Esc: quit");
    }
    ImGui::End();
    ImGui::Render();
}

bool Panel::hasMouse() const { return ImGui::GetIO().WantCaptureMouse; }
bool Panel::hasKeyboard() const { return ImGui::GetIO().WantTextInput; }

void Panel::draw(Command& command) const {
    const ImDrawData* data = ImGui::GetDrawData();
    if (!data || data->CmdListsCount == 0) return;
    const Vector2f size = {data->DisplaySize.x, data->DisplaySize.y};
    command.setPipeline(pipeline_);
    command.setTexture(0, font_);
    command.setSampler(0, sampler_);
    command.setPushConstants(size);
    for (int i = 0; i < data->CmdListsCount; i++) {
        const ImDrawList& list = *data->CmdLists[i];
        command.setVertices(0, std::span<const ImDrawVert>(list.VtxBuffer.Data, list.VtxBuffer.Size));
        command.setIndexData(sizeof(ImDrawIdx) == 2 ? FormatRu16 : FormatRu32, list.IdxBuffer.Data,
                             list.IdxBuffer.Size * sizeof(ImDrawIdx));
        for (const ImDrawCmd& draw : list.CmdBuffer) {
            const Vector2f corner = glm::max(Vector2f(draw.ClipRect.x, draw.ClipRect.y), Vector2f(0.0f));
            const Vector2f end = glm::min(Vector2f(draw.ClipRect.z, draw.ClipRect.w), size);
            if (end.x <= corner.x || end.y <= corner.y) continue;
            command.setScissor(static_cast<int32_t>(corner.x), static_cast<int32_t>(corner.y),
                               static_cast<uint32_t>(end.x - corner.x), static_cast<uint32_t>(end.y - corner.y));
            command.drawElements(draw.ElemCount, draw.IdxOffset, static_cast<int32_t>(draw.VtxOffset));
        }
    }
}

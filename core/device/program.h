#pragma once

#include <glint/base/status.h>
#include <glint/device/handle.h>
#include <glint/device/shader.h>

#include <cstdint>
#include <source_location>
#include <string_view>

namespace glint {

/// What Kernel and Pipeline have in common: shaders, constants, slots. Setters keep the first error, which create()
/// returns and the handle carries. Configure from one thread; once ready, use from any.
class Program : public Handle {
public:
    using Where = std::source_location;

    Program() = default;
    explicit Program(detail::Object* object) : Handle(object) {}

    /// Sets a compiled stage, replacing one of the same type.
    void setShader(const Shader& shader, Where where = Where::current());

    /// Value of a specialisation constant by its constant_id or its name in the shader. Checked by create():
    /// "program.constant" if no stage has it.
    void setConstant(uint32_t id, int32_t value);
    void setConstant(uint32_t id, uint32_t value);
    void setConstant(uint32_t id, float value);
    void setConstant(uint32_t id, bool value);
    void setConstant(std::string_view name, int32_t value);
    void setConstant(std::string_view name, uint32_t value);
    void setConstant(std::string_view name, float value);
    void setConstant(std::string_view name, bool value);

    /// Makes the native object. A second call fails with "program.created".
    Status create(Where where = Where::current());
    /// The same on one of the device's threads; the handle is Building until done. Recording with it waits.
    void createAsync(Where where = Where::current());
    /// Waits for createAsync and returns its outcome.
    Status wait() const;

    /// If a file of one of the shaders has changed, compiles it again and replaces the native object; recorders begun
    /// afterwards use it. On failure the program keeps working as it was and the error says why.
    /// True in `changed` if something was replaced.
    Status reload(bool* changed = nullptr, Where where = Where::current());

    /// Slots of a kind that the shaders declare.
    uint32_t getSlots(SlotKind kind) const;
    /// What setUniform(i) and the other slots refer to. Empty unless ready.
    const BindingLayout& getLayout() const;

protected:
    bool load(Shader shader, Where where);
    void declareSlots(SlotKind kind, uint32_t count, ShaderMask mask, bool exact, Where where);
};

}  // namespace glint

#pragma once

#include <glint/base/status.h>
#include <glint/device/handle.h>
#include <glint/device/shader.h>

#include <cstdint>
#include <source_location>
#include <string_view>

namespace glint {

/// What Kernel, Pipeline and Traversal have in common: shaders, constants, slots. Setters keep the first error, which
/// create() returns and the handle carries. Configure from one thread; once ready, use from any.
class Program : public Handle {
public:
    using Where = std::source_location;

    Program() = default;
    explicit Program(detail::Object* object) : Handle(object) {}

    /// Sets a compiled stage, replacing one of the same type; a Traversal adds it to its groups instead.
    void setShader(const Shader& shader, Where where = Where::current());

    /// Value of a specialisation constant by its constant_id or its name in the shader. Checked by create():
    /// "program.constant" if no stage has it.
    void setConstant(uint32_t id, int32_t value, Where where = Where::current());
    void setConstant(uint32_t id, uint32_t value, Where where = Where::current());
    void setConstant(uint32_t id, float value, Where where = Where::current());
    void setConstant(uint32_t id, bool value, Where where = Where::current());
    void setConstant(std::string_view name, int32_t value, Where where = Where::current());
    void setConstant(std::string_view name, uint32_t value, Where where = Where::current());
    void setConstant(std::string_view name, float value, Where where = Where::current());
    void setConstant(std::string_view name, bool value, Where where = Where::current());

    /// Optional declarations: slot `index` of a kind exists and is seen by the stages of `mask`; create() checks them
    /// against the shaders ("program.slots", "program.mask").
    void setUniformMask(uint32_t index, Shader::Mask mask, Where where = Where::current());
    void setStorageMask(uint32_t index, Shader::Mask mask, Where where = Where::current());
    void setStorageMasks(uint32_t index, uint32_t count, Shader::Mask mask, Where where = Where::current());
    void setTextureMask(uint32_t index, Shader::Mask mask, Where where = Where::current());
    void setTextureMasks(uint32_t index, uint32_t count, Shader::Mask mask, Where where = Where::current());
    void setSurfaceMask(uint32_t index, Shader::Mask mask, Where where = Where::current());
    void setSamplerMask(uint32_t index, Shader::Mask mask, Where where = Where::current());
    void setTracingMask(uint32_t index, Shader::Mask mask, Where where = Where::current());
    void setTexelMask(uint32_t index, Shader::Mask mask, Where where = Where::current());
    void setTableMask(uint32_t index, Shader::Mask mask, Where where = Where::current());

    /// Makes the native object from the stages set; what is configured afterwards changes nothing and is told to the
    /// message callback: "program.created", as for a second call. Errors: "program.*", "kernel.*", "pipeline.*",
    /// "traversal.*", "shader.*", see docs/errors.md.
    Status create(Where where = Where::current());
    /// The same on a thread of the process' pool; the handle is Building until done. Recording with it waits. When the
    /// last handle goes before that, so does the work, or its end is waited for if it has begun.
    void createAsync(Where where = Where::current());
    /// Waits for createAsync and returns its outcome; from any thread but out of the message callback.
    Status wait(Where where = Where::current()) const;

    /// If a file of one of the shaders has changed, compiles it again and replaces the native object, for lists
    /// submitted afterwards. Not while another thread records with the program. On failure the program keeps working as
    /// it was, the error says why, and the next attempt waits for the next change of a file. Constants and all other
    /// state stay; other resources or push constants fail with "program.layout_changed". True in `changed` if something
    /// was replaced.
    Status reload(bool* changed = nullptr, Where where = Where::current());

    /// Slots of a kind that the shaders declare; 0 unless ready.
    uint32_t getSlots(SlotKind kind) const;
    /// What setUniform(i) and the other slots refer to. Empty unless ready.
    const BindingLayout& getLayout() const;

protected:
    bool load(const Shader& shader, Where where);
    void declareSlots(SlotKind kind, uint32_t first, uint32_t count, ShaderMask mask, Where where);
};

}  // namespace glint

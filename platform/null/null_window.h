#pragma once

#include <platform/null/null_objects.h>

namespace glint::null {

/// A window that nobody sees. Its pictures are textures that take turns; what its user does is up to the NullControl.
class NullWindow final : public detail::NativeWindow, public NullObject {
public:
    NullWindow(std::shared_ptr<NullControl> control, const WindowDesc& desc);

    void poll(uint64_t) override {}
    detail::WindowEvents takeEvents() override;
    void setTitle(const std::string&) override {}
    void setSize(uint32_t width, uint32_t height) override;
    void setHidden(bool hidden) override;

    Expected<Pictures> createPictures() override;
    Expected<uint32_t> acquire() override;
    Status present() override;

private:
    const std::shared_ptr<NullControl> control_;
    const WindowDesc desc_;
    detail::WindowEvents events_;
    uint32_t next_ = 0;
};

}  // namespace glint::null

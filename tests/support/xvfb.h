#pragma once

#include <glint/format/image.h>

#include <string>

namespace glint::test {

/// An X server of this process's own without a screen, started when first asked for and ended after the last test.
/// While it runs $DISPLAY names it and $WAYLAND_DISPLAY is not set.
class Xvfb {
public:
    static Xvfb& get();

    /// False if the package is not installed: tests are skipped then. Any other reason why it does not run fails the
    /// test that asks.
    bool isInstalled() const { return is_installed_; }
    /// What its screen shows, RGBAu8n, alpha 1.
    Image screen() const;

private:
    Xvfb() { start(); }
    void start();

    bool is_installed_ = false;
    std::string picture_;  ///< file that the server keeps its screen in
};

/// At the beginning of a test: skips it where Xvfb is not installed.
#define GLINT_NEED_XVFB() \
    if (!::glint::test::Xvfb::get().isInstalled()) GTEST_SKIP() << "needs Xvfb (Debian's package xvfb)"

}  // namespace glint::test

#pragma once

/// The whole SDK but its helpers for files and geometry.
#include <glint/device/device.h>

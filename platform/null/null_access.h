#pragma once

#include <platform/null/null_objects.h>

#include <glint/device/detail/command_list.h>
#include <glint/device/detail/object.h>

namespace glint::null {

/// The checker of hazards believes the accesses that a command declares. This looks whether they are all: everything
/// that a command's own words name (bindings, attachments, copies, inputs of builds, the structures that a traced one
/// was built from) must be among them, at the right stage and with the right slice. Findings: "null.undeclared".
void checkAccesses(const detail::CommandList& list, NullControl& control);

}  // namespace glint::null

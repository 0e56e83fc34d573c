#include <glint/device/query.h>

#include <glint/device/detail/object.h>

namespace glint {

Query::Type Query::getType() const {
    return object_ ? static_cast<detail::QueryObject*>(object_)->query_type : TypeTime;
}

}  // namespace glint

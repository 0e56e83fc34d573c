# cmake -DNM=... -DLIBRARY=libglint.a -DOUTPUT=... -P list_exports.cmake: writes a version script that lets a shared library
# export what public headers declare. That is what lies in namespace glint or glint::shader, and of glint::vulkan what
# native.h has; detail and the other inner namespaces stay inside, as do copies of inline functions and what other
# libraries have left in the objects.

cmake_minimum_required(VERSION 3.25)

set(public "glint::([A-Z~]|[A-Za-z_]+[(]|operator)|glint::shader::|glint::vulkan::(native|import)[A-Z]")

foreach(form "" --demangle)
    execute_process(COMMAND ${NM} --defined-only --extern-only --format=bsd ${form} "${LIBRARY}"
        OUTPUT_VARIABLE text${form} COMMAND_ERROR_IS_FATAL ANY)
    # A CMake list cannot hold brackets that do not match, or semicolons.
    string(REPLACE ";" "," text${form} "${text${form}}")
    string(REPLACE "[" "(" text${form} "${text${form}}")
    string(REPLACE "]" ")" text${form} "${text${form}}")
    string(REGEX MATCHALL "[^\n]+" lines${form} "${text${form}}")
endforeach()

set(symbols "")
foreach(symbol name IN ZIP_LISTS lines lines--demangle)
    if(name MATCHES "^[0-9a-f]+ [TDBR] (${public})" OR name MATCHES "^[0-9a-f]+ [TDBRV] (vtable|typeinfo|typeinfo name) for glint::[A-Z]")
        string(REGEX REPLACE ".* " "" symbol "${symbol}")
        list(APPEND symbols "${symbol}")
    endif()
endforeach()
list(REMOVE_DUPLICATES symbols)
list(SORT symbols)
list(JOIN symbols ";\n    " lines)
if(NOT symbols)
    message(FATAL_ERROR "${LIBRARY} has nothing to export")
endif()
file(WRITE "${OUTPUT}" "{\nglobal:\n    ${lines};\nlocal: *;\n};\n")

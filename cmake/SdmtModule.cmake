# One function per kind of target, so that every target gets the same warnings and the same
# include rule: a module sees its own headers and those of the modules it links, nothing else.

function(sdmt_target_defaults target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  # -Wconversion: a value that may not survive a conversion is a mistake or is written out. Signs are
  # left to the eye: indices are int, sizes of the standard library are not.
  target_compile_options(${target} PRIVATE -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor
    -Wconversion -Wno-sign-conversion)
  if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
    target_compile_options(${target} PRIVATE -Wno-restrict)  # false alarms, GCC bug 105651
  endif()
  if(SDMT_WERROR)
    target_compile_options(${target} PRIVATE -Werror)
  endif()
  if(SDMT_SANITIZE)
    target_compile_options(${target} PRIVATE -fsanitize=${SDMT_SANITIZE} -fno-omit-frame-pointer)
    target_link_options(${target} PUBLIC -fsanitize=${SDMT_SANITIZE})
  endif()
  if(SDMT_COVERAGE)
    target_compile_options(${target} PRIVATE --coverage)
    target_link_options(${target} PUBLIC --coverage)
  endif()
endfunction()

# sdmt_add_module(<name> SOURCES <files> [PUBLIC <libs>] [PRIVATE <libs>])
# Makes the static library sdmt_<name>, known here and after installation as sdmt::<name>.
function(sdmt_add_module name)
  cmake_parse_arguments(ARG "" "" "SOURCES;PUBLIC;PRIVATE" ${ARGN})
  add_library(sdmt_${name} STATIC ${ARG_SOURCES})
  add_library(sdmt::${name} ALIAS sdmt_${name})
  sdmt_target_defaults(sdmt_${name})
  set_target_properties(sdmt_${name} PROPERTIES EXPORT_NAME ${name} POSITION_INDEPENDENT_CODE ON)
  target_include_directories(sdmt_${name}
    PUBLIC $<BUILD_INTERFACE:${CMAKE_CURRENT_SOURCE_DIR}/include>
           $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
    PRIVATE ${CMAKE_CURRENT_SOURCE_DIR})
  target_link_libraries(sdmt_${name} PUBLIC ${ARG_PUBLIC} PRIVATE ${ARG_PRIVATE})
  install(TARGETS sdmt_${name} EXPORT sdmt-${name}-targets
    ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT libsdmt-dev)
  install(EXPORT sdmt-${name}-targets NAMESPACE sdmt::
    DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/sdmt COMPONENT libsdmt-dev)
  install(DIRECTORY include/ DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT libsdmt-dev)
  set_property(GLOBAL APPEND PROPERTY SDMT_MODULES ${name})
endfunction()

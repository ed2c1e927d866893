# find_package(sdmt COMPONENTS track eval ...): one targets file per component, so that a consumer
# of eval needs no other package, and one of track neither OpenCV nor anything else that only train
# and pipeline use.
include(CMakePackageConfigHelpers)
get_property(SDMT_INSTALLED_MODULES GLOBAL PROPERTY SDMT_MODULES)
configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/sdmt-config.cmake.in
  ${PROJECT_BINARY_DIR}/sdmt-config.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/sdmt)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/sdmt-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/sdmt-config.cmake ${PROJECT_BINARY_DIR}/sdmt-config-version.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/sdmt COMPONENT libsdmt-dev)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/docs/examples
  DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libsdmt-dev COMPONENT libsdmt-dev)
install(FILES ${PROJECT_SOURCE_DIR}/models/README.md
  DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sdmt-models COMPONENT sdmt-models)

# Removes what `cmake --install` (or the target install) put somewhere, and folders left empty.
add_custom_target(uninstall COMMAND ${CMAKE_COMMAND}
  -DMANIFEST=${PROJECT_BINARY_DIR}/install_manifest.txt
  -P ${PROJECT_SOURCE_DIR}/cmake/uninstall.cmake)

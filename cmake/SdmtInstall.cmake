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
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/sdmt)

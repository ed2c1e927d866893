# cpack -G DEB: sdmt, libsdmt0, libsdmt-dev, python3-sdmt and sdmt-models, one a component. Configure
# with -DCMAKE_INSTALL_PREFIX=/usr (preset `package`), so that libraries go where Debian has them.
set(packages sdmt sdmt-models libsdmt-dev)
if(TARGET sdmt_c)
  list(APPEND packages libsdmt0)
endif()
if(TARGET _sdmt)
  list(APPEND packages python3-sdmt)
endif()

# The documents that a Debian package has: licence, what changed, and what is inside (SPDX).
set(work ${PROJECT_BINARY_DIR}/packaging)
set(SDMT_CONTACT "SDMT developers <sdmt@example.org>" CACHE STRING "Maintainer of the packages")
foreach(package hwy OpenCV fmt nlohmann_json CLI11)
  if(NOT ${package}_VERSION)
    find_package(${package} QUIET)
  endif()
endforeach()
find_package(PkgConfig QUIET)
foreach(package ompi libavformat libturbojpeg cpp-httplib libmosquitto)
  if(PkgConfig_FOUND)
    pkg_check_modules(sbom_${package} QUIET ${package})
  endif()
endforeach()
# sdmt_spdx(<id> <name> <version> <home> <licence> <link>): a package of others that is inside, or is
# linked by what is; an empty version is one that is not known.
function(sdmt_spdx id name version home licence link)
  if(NOT version)
    set(version NOASSERTION)
  endif()
  set(SDMT_SPDX_PACKAGES "${SDMT_SPDX_PACKAGES}
PackageName: ${name}
SPDXID: SPDXRef-${id}
PackageVersion: ${version}
PackageDownloadLocation: ${home}
FilesAnalyzed: false
PackageLicenseDeclared: ${licence}
PackageLicenseConcluded: ${licence}
PackageCopyrightText: NOASSERTION
Relationship: SPDXRef-sdmt ${link} SPDXRef-${id}
" PARENT_SCOPE)
endfunction()
set(SDMT_SPDX_PACKAGES "")
sdmt_spdx(highway highway "${hwy_VERSION}" https://github.com/google/highway Apache-2.0
  DYNAMIC_LINK)
sdmt_spdx(opencv opencv "${OpenCV_VERSION}" https://opencv.org Apache-2.0 DYNAMIC_LINK)
sdmt_spdx(ffmpeg "FFmpeg (libavformat, libavcodec, libavutil, libswscale)"
  "${sbom_libavformat_VERSION}" https://ffmpeg.org GPL-2.0-or-later DYNAMIC_LINK)
sdmt_spdx(libjpeg-turbo libjpeg-turbo "${sbom_libturbojpeg_VERSION}" https://libjpeg-turbo.org
  "BSD-3-Clause AND IJG" DYNAMIC_LINK)
sdmt_spdx(fmt fmt "${fmt_VERSION}" https://fmt.dev MIT DYNAMIC_LINK)
if(TARGET sdmt_mpi)
  sdmt_spdx(openmpi "Open MPI" "${sbom_ompi_VERSION}" https://www.open-mpi.org BSD-3-Clause
    DYNAMIC_LINK)
endif()
sdmt_spdx(nlohmann-json nlohmann-json "${nlohmann_json_VERSION}" https://json.nlohmann.me MIT
  STATIC_LINK)
sdmt_spdx(CLI11 CLI11 "${CLI11_VERSION}" https://github.com/CLIUtils/CLI11 BSD-3-Clause STATIC_LINK)
if(sbom_cpp-httplib_VERSION)
  sdmt_spdx(cpp-httplib cpp-httplib "${sbom_cpp-httplib_VERSION}"
    https://github.com/yhirose/cpp-httplib MIT DYNAMIC_LINK)
endif()
if(sbom_libmosquitto_VERSION)
  sdmt_spdx(libmosquitto libmosquitto "${sbom_libmosquitto_VERSION}" https://mosquitto.org
    "EPL-2.0 OR BSD-3-Clause" DYNAMIC_LINK)
endif()
if(TARGET _sdmt)
  sdmt_spdx(pybind11 pybind11 "${pybind11_VERSION}" https://github.com/pybind/pybind11 BSD-3-Clause
    STATIC_LINK)
endif()
sdmt_spdx(gcc-runtime "GCC run-time libraries (libgomp, libstdc++, libgcc)"
  "${CMAKE_CXX_COMPILER_VERSION}" https://gcc.gnu.org "GPL-3.0-or-later WITH GCC-exception-3.1"
  STATIC_LINK)
configure_file(${PROJECT_SOURCE_DIR}/packaging/sdmt.spdx.in ${work}/sdmt.spdx @ONLY)
configure_file(${PROJECT_SOURCE_DIR}/packaging/changelog.in ${work}/changelog.Debian @ONLY)
configure_file(${PROJECT_SOURCE_DIR}/packaging/copyright ${work}/copyright COPYONLY)
configure_file(${PROJECT_SOURCE_DIR}/CHANGELOG.md ${work}/changelog COPYONLY)
find_program(GZIP gzip)
foreach(file changelog changelog.Debian)
  execute_process(COMMAND ${GZIP} -9nf ${work}/${file})
endforeach()
foreach(package IN LISTS packages)
  install(FILES ${work}/copyright ${work}/changelog.gz ${work}/changelog.Debian.gz
      ${work}/sdmt.spdx
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${package} COMPONENT ${package})
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME sdmt)
set(CPACK_PACKAGE_CONTACT ${SDMT_CONTACT})
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each has its own
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL ${packages})
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(version "${PROJECT_VERSION}-1")

# sdmt_deb(<component> SECTION <section> SUMMARY <line> TEXT <text> [DEPENDS] [RECOMMENDS] [SUGGESTS])
macro(sdmt_deb component)
  cmake_parse_arguments(DEB "" "SECTION;SUMMARY;TEXT;DEPENDS;RECOMMENDS;SUGGESTS" "" ${ARGN})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${component})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${DEB_SECTION})
  set(CPACK_DEBIAN_${upper}_DESCRIPTION "${DEB_SUMMARY}\n${DEB_TEXT}")
  set(CPACK_COMPONENT_${upper}_DESCRIPTION "${DEB_SUMMARY}\n${DEB_TEXT}")
  foreach(relation DEPENDS RECOMMENDS SUGGESTS)
    if(DEB_${relation})
      set(CPACK_DEBIAN_${upper}_PACKAGE_${relation} "${DEB_${relation}}")
    endif()
  endforeach()
endmacro()

sdmt_deb(sdmt SECTION science SUMMARY "online pedestrian tracking"
  TEXT "Tracks people through videos, cameras and image sequences by motion and by a\nnetwork that tells people apart. Trains and validates such networks, and\nscores tracks as the MOTChallenge benchmarks do."
  DEPENDS "sdmt-models (= ${version})"
  SUGGESTS "openmpi-bin")
sdmt_deb(sdmt-models SECTION science SUMMARY "networks of sdmt that tell people apart"
  TEXT "Weights that turn a picture of a person into a vector: the paper's network and\na small one. Their cards say what they were trained on.")
sdmt_deb(libsdmt0 SECTION libs SUMMARY "online pedestrian tracking, C interface"
  TEXT "The tracker, the embedding networks and the scores of sdmt as a shared library\nwith a stable C interface.")
sdmt_deb(libsdmt-dev SECTION libdevel SUMMARY "online pedestrian tracking, development files"
  TEXT "Header and link of the C interface, and the static C++ libraries of sdmt with\ntheir headers, CMake and pkg-config files and examples."
  DEPENDS "libsdmt0 (= ${version})"
  SUGGESTS "libhwy-dev, libopencv-dev, libturbojpeg0-dev, libavformat-dev, libswscale-dev, libfmt-dev, g++, cmake")
if(TARGET _sdmt)
  math(EXPR next "${Python_VERSION_MINOR} + 1")
  set(python ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR})
  sdmt_deb(python3-sdmt SECTION python SUMMARY "online pedestrian tracking, Python module"
    TEXT "Trackers, embedding networks, scores, training and tuning of sdmt for NumPy\narrays."
    DEPENDS
      "python3 (>= ${python}~), python3 (<< ${Python_VERSION_MAJOR}.${next}), python3-numpy"
    RECOMMENDS "sdmt-models (= ${version})")
endif()
set(CPACK_DEBIAN_SDMT-MODELS_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_SDMT-MODELS_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_LIBSDMT-DEV_PACKAGE_SHLIBDEPS OFF)
set(extra ${PROJECT_SOURCE_DIR}/packaging)
set(CPACK_DEBIAN_LIBSDMT0_PACKAGE_CONTROL_EXTRA ${extra}/libsdmt0/shlibs ${extra}/libsdmt0/triggers)
# Python keeps what it compiled; it goes with the package.
set(CPACK_DEBIAN_PYTHON3-SDMT_PACKAGE_CONTROL_EXTRA
  ${extra}/python3-sdmt/postinst ${extra}/python3-sdmt/prerm)
include(CPack)

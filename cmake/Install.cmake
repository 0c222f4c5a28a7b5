# What `cmake --install` puts where, for CMake's find_package and for pkg-config. Nothing of it holds the prefix.
# Components of the installation: libraries (what a program loads), development, program, python.

include(CMakePackageConfigHelpers)
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/fathom)

# What find_package(fathom COMPONENTS ...) may ask for, and what this build has of it.
set(FATHOM_COMPONENTS camera core)
set(installed_libraries fathom_camera fathom)
set(camera_file_headers camera_file.hpp import_camera.hpp presets.hpp)
set(io_headers exr.hpp frames.hpp io.hpp opencv.hpp picture.hpp)
set(left_out)
if(TARGET fathom_camera_file)
  list(APPEND FATHOM_COMPONENTS camera_file)
  list(APPEND installed_libraries fathom_camera_file)
else()
  list(APPEND left_out ${camera_file_headers})
endif()
if(TARGET fathom_io)
  list(APPEND FATHOM_COMPONENTS io)
  list(APPEND installed_libraries fathom_io)
else()
  list(APPEND left_out ${io_headers})
endif()
if(FATHOM_SHARED)
  list(TRANSFORM installed_libraries APPEND _shared)
endif()

install(TARGETS ${installed_libraries} EXPORT fathom-targets
  LIBRARY COMPONENT libraries NAMELINK_COMPONENT development ARCHIVE COMPONENT development)
set(patterns)
foreach(header IN LISTS left_out)
  list(APPEND patterns PATTERN ${header} EXCLUDE)
endforeach()
install(DIRECTORY include/fathom DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development ${patterns})
if(TARGET fathom_program)
  install(TARGETS fathom_program COMPONENT program)
endif()

# CMake.
install(EXPORT fathom-targets NAMESPACE fathom:: DESTINATION ${config_dir} COMPONENT development)
configure_package_config_file(cmake/fathom-config.cmake.in fathom-config.cmake INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(fathom-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/fathom-config.cmake ${PROJECT_BINARY_DIR}/fathom-config-version.cmake
  cmake/FindOpenCV.cmake DESTINATION ${config_dir} COMPONENT development)

# pkg-config. The file finds the prefix from its own place.
file(RELATIVE_PATH PREFIX_FROM_PC /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
string(REGEX REPLACE "/$" "" PREFIX_FROM_PC ${PREFIX_FROM_PC})
# A static library leaves it to the program to link what the library uses.
function(fathom_pkg_config NAME)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" DESCRIPTION "REQUIRES;REQUIRES_IF_STATIC;LIBS;CFLAGS")
  if(NOT FATHOM_SHARED)
    list(APPEND arg_REQUIRES ${arg_REQUIRES_IF_STATIC})
  endif()
  list(JOIN arg_REQUIRES " " REQUIRES)
  list(JOIN arg_LIBS " " LIBS)
  list(JOIN arg_CFLAGS " " CFLAGS)
  configure_file(cmake/library.pc.in ${NAME}.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/${NAME}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endfunction()
fathom_pkg_config(fathom_camera DESCRIPTION "Cameras and lenses of Fathom" REQUIRES eigen3)
fathom_pkg_config(fathom DESCRIPTION "${PROJECT_DESCRIPTION}" REQUIRES fathom_camera OpenCL)
if(TARGET fathom_camera_file)
  fathom_pkg_config(fathom_camera_file DESCRIPTION "Camera files of Fathom" REQUIRES fathom_camera)
endif()
if(TARGET fathom_io)
  # Debian has opencv4.pc with all of OpenCV only.
  get_target_property(opencv_include opencv_core INTERFACE_INCLUDE_DIRECTORIES)
  list(TRANSFORM opencv_include PREPEND -I)
  fathom_pkg_config(fathom_io DESCRIPTION "Fathom with images of OpenCV and in files"
    REQUIRES fathom fathom_camera_file REQUIRES_IF_STATIC OpenEXR zlib tbb yaml-cpp
    LIBS -lopencv_core CFLAGS ${opencv_include})
endif()

# Debian packages: `cpack -G DEB` in the build of the preset `package`, which scripts/package runs.
#   libfathom0.3    the shared libraries
#   libfathom-dev   headers, and what CMake and pkg-config read
#   fathom          the program
#   python3-fathom  the module for Debian's own Python, if there is FATHOM_PYTHON
# The program and the module hold what they need of the libraries.

set(library_package libfathom${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
set(packages libraries ${library_package} development libfathom-dev program fathom python python3-fathom)
set(components libraries development)
if(TARGET fathom_program)
  list(APPEND components program)
endif()
if(FATHOM_PYTHON)
  list(APPEND components python)
endif()

# What a folder of documentation has to hold. A plain `cmake --install` leaves these out.
foreach(component IN LISTS components)
  list(FIND packages ${component} at)
  math(EXPR at "${at} + 1")
  list(GET packages ${at} package)
  string(TOUPPER ${component} COMPONENT)
  set(CPACK_DEBIAN_${COMPONENT}_PACKAGE_NAME ${package})
  install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${package} RENAME copyright
    COMPONENT ${component} EXCLUDE_FROM_ALL)
  install(FILES ${PROJECT_SOURCE_DIR}/CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/${package}
    COMPONENT ${component} EXCLUDE_FROM_ALL)
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL ${components})
set(CPACK_PACKAGE_CONTACT "The Fathom authors <authors@fathom.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "") # each package begins its description with its own
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR})
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# The libraries of other packages come from the files themselves.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY =)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS
  ${PROJECT_BINARY_DIR} ${PROJECT_BINARY_DIR}/src/camera_file ${PROJECT_BINARY_DIR}/src/io)

# They do not name OpenCV's codecs, which are loaded by name: libopencv_imgcodecs.so.406 is in libopencv-imgcodecs406.
get_property(codecs GLOBAL PROPERTY FATHOM_IMGCODECS)
if(codecs)
  string(REGEX REPLACE "^libopencv_imgcodecs\\.so\\." "libopencv-imgcodecs" codecs ${codecs})
  set(CPACK_DEBIAN_LIBRARIES_PACKAGE_DEPENDS ${codecs})
  set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS ${codecs})
endif()

# OpenCL's loader is one of them; a driver is what it needs to do something, and any will do.
set(driver "pocl-opencl-icd | opencl-icd")
set(same_version "${library_package} (= ${PROJECT_VERSION})")

set(CPACK_COMPONENT_LIBRARIES_DESCRIPTION "exact post-processing of depth images: shared libraries
Fathom turns a depth image and a description of its camera into distances,
3D points, normals, ambient occlusion, camera blur and fog.")
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_SECTION libs)
set(CPACK_DEBIAN_LIBRARIES_PACKAGE_RECOMMENDS "${driver}")

set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "exact post-processing of depth images: headers
What a program in C++20 needs to use Fathom: headers, and files for CMake's
find_package and for pkg-config.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(needed_by_headers "${same_version}" libeigen3-dev ocl-icd-opencl-dev)
if(TARGET fathom_io)
  list(APPEND needed_by_headers libopencv-core-dev)
endif()
list(JOIN needed_by_headers ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS)

set(CPACK_COMPONENT_PROGRAM_DESCRIPTION "exact post-processing of depth images: program
The program fathom turns a depth image and a description of its camera into
distances, 3D points, normals, ambient occlusion, camera blur and fog.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS "${driver}")

set(CPACK_COMPONENT_PYTHON_DESCRIPTION "exact post-processing of depth images: Python module
The module fathom turns NumPy arrays of depth into distances, 3D points,
normals, ambient occlusion, camera blur and fog.")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
if(FATHOM_PYTHON)
  find_package(Python REQUIRED COMPONENTS Interpreter)
  math(EXPR next_minor "${Python_VERSION_MINOR} + 1")
  string(CONCAT CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}), "
    "python3 (<< ${Python_VERSION_MAJOR}.${next_minor}), python3-numpy")
  if(codecs)
    string(APPEND CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS ", ${codecs}")
  endif()
endif()
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "${driver}")

include(CPack)

# What the build itself links is static: the program and the tests use internals, which shared libraries hide.
# With BUILD_SHARED_LIBS each library is made a second time, shared and of the same objects, for others to link.

option(BUILD_SHARED_LIBS "Make shared libraries too, and install those" OFF)
set(FATHOM_SHARED ${BUILD_SHARED_LIBS})
set(BUILD_SHARED_LIBS OFF) # here and below

# Only what a header of include/fathom declares is visible outside of a shared library.
set(CMAKE_CXX_VISIBILITY_PRESET hidden)
set(CMAKE_VISIBILITY_INLINES_HIDDEN ON)
set(CMAKE_POSITION_INDEPENDENT_CODE ON) # somebody's module may hold the static ones

# fathom_library(TARGET NAME [PUBLIC LIBRARY...] [PRIVATE LIBRARY...] [INTERNALS TARGET...])
# Links a library of Fathom and lets others have it as fathom::NAME.
#   PUBLIC     what its headers need: other targets of Fathom, or imported ones
#   PRIVATE    what its sources need
#   INTERNALS  targets of Fathom among PUBLIC whose internals it uses. A shared library takes its own copy of those objects,
#              so they must keep no state
function(fathom_library target name)
  cmake_parse_arguments(PARSE_ARGV 2 arg "" "" "PUBLIC;PRIVATE;INTERNALS")
  set(include $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/include> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  target_include_directories(${target} PUBLIC ${include})
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_compile_options(${target} PRIVATE -ffp-contract=off) # processors with fused products give the same constants
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 15) # takes a third of the time
  target_link_libraries(${target} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE})
  if(NOT FATHOM_SHARED)
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
    add_library(fathom::${name} ALIAS ${target})
    return()
  endif()

  set(shared ${target}_shared)
  add_library(${shared} SHARED $<TARGET_OBJECTS:${target}>)
  # A version 0.x promises nothing to the next one.
  set_target_properties(${shared} PROPERTIES OUTPUT_NAME ${target} EXPORT_NAME ${name} LINKER_LANGUAGE CXX
    VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR} INSTALL_RPATH $ORIGIN)
  target_include_directories(${shared} PUBLIC ${include})
  target_compile_features(${shared} PUBLIC cxx_std_20)
  list(TRANSFORM arg_PUBLIC APPEND _shared REGEX "^fathom")
  target_link_libraries(${shared} PUBLIC ${arg_PUBLIC} PRIVATE ${arg_PRIVATE} ${arg_INTERNALS})
  foreach(internals IN LISTS arg_INTERNALS)
    target_link_options(${shared} PRIVATE LINKER:--exclude-libs,$<TARGET_FILE_NAME:${internals}>)
  endforeach()
  add_library(fathom::${name} ALIAS ${shared})
endfunction()

# The tests as another build has compiled them, with the libraries of this one that read and write files: the sanitizers look at
# those, and compiling the rest takes longer than all of them. Whole libraries come first, so that the code that is checked is
# also what the tests take from headers. What measures the bench is left out.
set(objects ${test_files})
list(FILTER objects EXCLUDE REGEX "/places\\.cpp$")
list(TRANSFORM objects REPLACE ".*/(.+)" "${FATHOM_TESTS_FROM}/tests/CMakeFiles/fathom_tests.dir/\\1.o")
list(GET objects 0 object)
if(NOT EXISTS ${object})
  message(FATAL_ERROR "${FATHOM_TESTS_FROM}: has no compiled tests; build its target fathom_tests first")
endif()
list(APPEND objects ${FATHOM_TESTS_FROM}/tests/CMakeFiles/fathom_catch_main.dir/main.cpp.o)
add_executable(fathom_tests places.cpp)
set_property(TARGET fathom_tests APPEND PROPERTY LINK_DEPENDS ${objects})
find_package(fmt REQUIRED)
list(APPEND CMAKE_MODULE_PATH ${PROJECT_SOURCE_DIR}/cmake)
find_package(OpenCV REQUIRED COMPONENTS imgcodecs imgproc)
set(checked fathom_io fathom_camera_file fathom fathom_camera)
list(TRANSFORM checked REPLACE "(.+)" "$<TARGET_FILE:\\1>" OUTPUT_VARIABLE archives)
target_link_options(fathom_tests PRIVATE LINKER:--whole-archive ${archives} LINKER:--no-whole-archive)
target_link_libraries(fathom_tests PRIVATE ${objects}
  ${FATHOM_TESTS_FROM}/docs/charts/articles/libfathom_article_curves.a
  ${FATHOM_TESTS_FROM}/bench/regimes/libfathom_regimes.a
  ${FATHOM_TESTS_FROM}/tests/truth/libfathom_truth.a
  ${FATHOM_TESTS_FROM}/examples/scene/libfathom_scene.a
  ${FATHOM_TESTS_FROM}/tests/fuzz/libfathom_fuzz_targets.a
  ${FATHOM_TESTS_FROM}/src/cli/libfathom_cli.a
  ${FATHOM_TESTS_FROM}/src/shot/libfathom_shot.a
  ${FATHOM_TESTS_FROM}/src/sequence/libfathom_sequence.a
  ${checked} quadmath fmt::fmt OpenEXR::OpenEXR TIFF::TIFF ZLIB::ZLIB opencv_imgcodecs opencv_imgproc)

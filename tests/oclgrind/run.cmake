# Runs a program under Oclgrind and fails on anything in its log: Oclgrind itself always exits with the program's status.
#   cmake -DOCLGRIND=... -DPROGRAM=... -DLANES=... -DLOG=... -P run.cmake

# Oclgrind 21.10 knows neither prefetches nor what forced inlining leaves behind. On optimised code it crashes if
# vectors have 16 lanes, or lacks functions that the code calls (funnel shifts). None of this changes results.
# Uninitialised reads are not looked for: whether Oclgrind reports some depends on which buffers were made and released before,
# and the kernels of normals alone are reported after those of fog, but not before them.
set(build "-D__builtin_prefetch(pointer,write,locality)= -Dalways_inline= -cl-opt-disable")
set(watch --data-races)

file(REMOVE ${LOG})
execute_process(
  COMMAND ${OCLGRIND} ${watch} --build-options ${build} --log ${LOG} ${PROGRAM} ${LANES}
  OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE status)
message("${output}")
if(NOT status EQUAL 0 OR NOT output MATCHES "Oclgrind Simulator" OR NOT output MATCHES "[0-9]+ images")
  message(FATAL_ERROR "the program did not run to its end on Oclgrind's device: ${status}")
endif()

file(READ ${LOG} log)
string(STRIP "${log}" log)
if(log)
  string(SUBSTRING "${log}" 0 4000 log)
  message(FATAL_ERROR "Oclgrind found:\n${log}")
endif()

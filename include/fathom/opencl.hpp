#pragma once

// OpenCL's handles by the names that its own headers give them, so that neither those headers nor their macros are needed.
// A repeated typedef is legal: include <CL/cl.h> or <CL/opencl.hpp> before or after, as you like.
typedef struct _cl_command_queue* cl_command_queue;
typedef struct _cl_context* cl_context;
typedef struct _cl_device_id* cl_device_id;
typedef struct _cl_event* cl_event;
typedef struct _cl_mem* cl_mem;

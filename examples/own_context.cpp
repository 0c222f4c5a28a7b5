// Fathom between two steps of a program that has its own OpenCL context: its buffers, its queue, events on both sides.

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>
#include <fathom/fathom.hpp>

#include <iostream>
#include <vector>

int main() {
    constexpr int width = 640, height = 480;
    constexpr std::size_t margin = 16, stride = width + margin; // floats before the first row, and from row to row
    std::vector<float> frame(margin + stride * height, 0.99f);

    // What such a program has already.
    cl_platform_id platform;
    cl_device_id id;
    if (clGetPlatformIDs(1, &platform, nullptr) != CL_SUCCESS ||
        clGetDeviceIDs(platform, CL_DEVICE_TYPE_ALL, 1, &id, nullptr) != CL_SUCCESS)
        return 1;
    cl_context context = clCreateContext(nullptr, 1, &id, nullptr, nullptr, nullptr);
    cl_command_queue queue = clCreateCommandQueue(context, id, 0, nullptr);
    cl_mem stored = clCreateBuffer(context, CL_MEM_READ_ONLY, frame.size() * sizeof(float), nullptr, nullptr);
    cl_mem depth = clCreateBuffer(context, CL_MEM_READ_WRITE, width * height * sizeof(float), nullptr, nullptr);
    cl_event uploaded, computed;
    clEnqueueWriteBuffer(queue, stored, CL_FALSE, 0, frame.size() * sizeof(float), frame.data(), 0, nullptr, &uploaded);

    // Fathom takes the handles as they are. Nothing is copied, and the call returns before the kernel has run.
    fathom::Camera camera;
    camera.projection = fathom::perspective(1.0, double{width} / height, {.near_plane = 0.1, .far_plane = 100});
    camera.width = width;
    camera.height = height;
    const fathom::Device device(context, id, queue);
    const fathom::Image in(device, stored, fathom::Element::f32, {width, height, 1, stride}, margin);
    const fathom::Image out(device, depth, fathom::Element::f32, {width, height, 1, width});
    fathom::linearize({in, camera}, out, {}, {.wait = {uploaded}, .event = &computed});

    float corner = 0;
    clEnqueueReadBuffer(queue, depth, CL_TRUE, 0, sizeof(corner), &corner, 1, &computed, nullptr);
    std::cout << "stored 0.99 is " << corner << " in front of the camera\n";

    clReleaseEvent(uploaded);
    clReleaseEvent(computed);
    clReleaseMemObject(stored);
    clReleaseMemObject(depth);
    clReleaseCommandQueue(queue);
    clReleaseContext(context);
}

#pragma once

#include "catch.hpp"

#include <fathom/device.hpp>

#define CL_TARGET_OPENCL_VERSION 120
#include <CL/cl.h>

#include <list>

/// A context of a device that is not the library's, as a program has one, and its queues.
class OwnContext {
public:
    explicit OwnContext(cl_device_id device) : id_(device) {
        cl_int code = CL_SUCCESS;
        context_ = {clCreateContext(nullptr, 1, &device, nullptr, nullptr, &code), clReleaseContext};
        REQUIRE(code == CL_SUCCESS);
    }

    cl_context get() const { return context_.get(); }

    /// A `Device` of a new queue, which lives as long as this.
    fathom::Device device(cl_command_queue_properties properties = 0) {
        queues_.emplace_back(clCreateCommandQueue(get(), id_, properties, nullptr), clReleaseCommandQueue);
        REQUIRE(queues_.back() != nullptr);
        return {get(), id_, queues_.back().get()};
    }
    fathom::Device out_of_order() { return device(CL_QUEUE_OUT_OF_ORDER_EXEC_MODE_ENABLE); }

private:
    cl_device_id id_;
    std::shared_ptr<_cl_context> context_;
    std::list<std::shared_ptr<_cl_command_queue>> queues_;
};

// A built-in function around one of nanobind's: it has a signature, and words for arguments that do not fit.
#include "bindings.hpp"

#include <string>

namespace fathom::python {
namespace {

namespace nb = nanobind;

// What a function calls, kept in the module that it belongs to, as built-in functions have one.
struct Function {
    PyObject *function, *explain;
    PyMethodDef method;
    std::string name, doc;
};

Function*& of(PyObject* module) {
    return *static_cast<Function**>(PyModule_GetState(module));
}

void release(void* module) {
    Function* ended = of(static_cast<PyObject*>(module));
    if (!ended)
        return;
    Py_DECREF(ended->function);
    Py_DECREF(ended->explain);
    delete ended;
}

// `explain` raises a better TypeError, or returns.
PyObject* call(PyObject* module, PyObject* const* arguments, Py_ssize_t count, PyObject* names) {
    const Function& to = *of(module);
    PyObject* result = PyObject_Vectorcall(to.function, arguments, static_cast<std::size_t>(count), names);
    if (result || !PyErr_ExceptionMatches(PyExc_TypeError))
        return result;
    PyObject *type, *value, *trace;
    PyErr_Fetch(&type, &value, &trace);
    PyErr_NormalizeException(&type, &value, &trace);
    try {
        nb::list positional;
        for (Py_ssize_t i = 0; i < count; ++i)
            positional.append(nb::handle(arguments[i]));
        nb::dict named;
        for (Py_ssize_t i = 0; names && i < PyTuple_Size(names); ++i)
            named[nb::handle(PyTuple_GetItem(names, i))] = nb::handle(arguments[count + i]);
        nb::handle(to.explain)(nb::handle(value), positional, named);
    } catch (nb::python_error& better) {
        better.restore();
        Py_XDECREF(type);
        Py_XDECREF(value);
        Py_XDECREF(trace);
        return nullptr;
    } catch (...) { // not enough memory to explain: the error itself is told
        PyErr_Clear();
    }
    PyErr_Restore(type, value, trace);
    return nullptr;
}

nb::object built_in(const char* name, const char* signature, const char* doc, const nb::object& function,
                    const nb::object& explain) {
    static PyModuleDef definition{.m_base = PyModuleDef_HEAD_INIT,
                                  .m_name = "fathom",
                                  .m_doc = nullptr,
                                  .m_size = sizeof(Function*),
                                  .m_methods = nullptr,
                                  .m_slots = nullptr,
                                  .m_traverse = nullptr,
                                  .m_clear = nullptr,
                                  .m_free = release};
    const nb::object module = nb::steal(PyModule_Create(&definition));
    auto* made = new Function{.function = function.inc_ref().ptr(),
                              .explain = explain.inc_ref().ptr(),
                              .method = {},
                              .name = name,
                              .doc = std::string(name) + signature + "\n--\n\n" + doc};
    of(module.ptr()) = made;
    made->method = {made->name.c_str(), reinterpret_cast<PyCFunction>(reinterpret_cast<void*>(call)),
                    METH_FASTCALL | METH_KEYWORDS, made->doc.c_str()};
    return nb::steal(PyCFunction_NewEx(&made->method, module.ptr(), nb::str("fathom").ptr()));
}

} // namespace

void bind_functions(nb::module_& module) {
    module.def("_built_in", built_in);
}

} // namespace fathom::python

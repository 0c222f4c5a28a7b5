#pragma once

#include "description/operations.hpp"

#include <string>
#include <vector>

/// What Python shows of an operation: signatures, words, and stubs for type checkers.
namespace fathom::python {

/// A function that makes images of a depth image.
struct Signature {
    struct Parameter {
        std::string name, type;
        bool optional = true;
        bool asks_for_result = false;
    };

    std::string name, doc;
    std::vector<Parameter> arguments, keywords = {}; ///< arguments need no name
    std::string results = {};                        ///< the type of several results
    bool may_be_alone = true;                        ///< is there a call with one result?

    /// As `def` has it.
    std::string in_words() const;
};

Signature signature_of(const description::Operation& operation);

/// The same for a function of this module, which takes depth and a camera.
Signature signature_of(const char* name, const char* doc);

/// The stub of these functions and of what the operations give.
std::string stub_of(const std::vector<Signature>& functions);

/// The words of a result: its shape, and what it is.
std::string words_of(const description::Result& result);

} // namespace fathom::python

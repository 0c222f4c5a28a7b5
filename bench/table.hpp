#pragma once

#include <fathom/device.hpp>

#include <filesystem>
#include <string>
#include <variant>
#include <vector>

namespace fathom::bench {

/// Nothing, a number or a text. A number that is not finite is written as nothing.
using Cell = std::variant<std::monostate, double, std::string>;

/// A table with named columns, for programs to read. Before the columns of its own every row has
///   device   as OpenCL names it
///   driver   its platform and driver version
///   commit   of the sources that the bench was built from; a + after it: and changes to them
/// A file is written whole or not at all.
class Table {
public:
    Table(const Device& device, std::vector<std::string> columns);

    /// One cell a column. Throws: std::logic_error for another number of them.
    void add(std::vector<Cell> row);

    /// Text in quotes where it needs them, numbers to six digits, nothing as an empty field.
    std::string csv() const;

    /// Throws: Error when the file cannot be written.
    void write_csv(const std::filesystem::path& file) const;

private:
    std::vector<std::string> columns_;
    std::vector<Cell> origin_;
    std::vector<std::vector<Cell>> rows_;
};

/// The commit that the bench was built from.
std::string commit();

} // namespace fathom::bench

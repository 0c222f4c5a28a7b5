# Writes OUTPUT: a C++ file that holds the text of every one of FILES, byte for byte.
set(text "#include \"runtime/program.hpp\"\n\nnamespace fathom::runtime {\n\nconst std::map<std::string, std::string>& kernel_files() {\n    static const std::map<std::string, std::string> files{\n")
foreach(file IN LISTS FILES)
  cmake_path(GET file FILENAME name)
  file(READ "${file}" content)
  string(APPEND text "        {\"${name}\", R\"fathom_kernel(${content})fathom_kernel\"},\n")
endforeach()
string(APPEND text "    };\n    return files;\n}\n\n} // namespace fathom::runtime\n")
file(WRITE "${OUTPUT}" "${text}")

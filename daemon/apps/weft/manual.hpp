#pragma once
// The command line told to other programs, from the table that it is parsed by: a manual page, and
// what a shell completes.

#include <string>

namespace CLI {
class App;
}

namespace weft::daemon::cli {

/// A page of section 1 in roff (man(7)): every command with its arguments and options.
std::string manual_page(const CLI::App& root);

/// A script for bash: commands and options of the program; files where neither fits.
std::string bash_completion(const CLI::App& root);

}  // namespace weft::daemon::cli

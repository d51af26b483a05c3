// The `weft` command line; see daemon/cli/app.hpp.

#include <unistd.h>

#include <iostream>

#include "daemon/cli/app.hpp"

int main(int argc, char** argv) {
  weft::daemon::cli::Console console{std::cout, std::cerr,
                                     false,     isatty(STDERR_FILENO) == 1,
                                     &std::cin, isatty(STDIN_FILENO) == 1 ? STDIN_FILENO : -1};
  return weft::daemon::cli::run(argc, argv, console);
}

// The `weft` command line; see daemon/apps/weft/commands.hpp.

#include <unistd.h>

#include <iostream>

#include "daemon/apps/weft/commands.hpp"

int main(int argc, char** argv) {
  weft::daemon::cli::Console console{std::cout, std::cerr,
                                     false,     isatty(STDERR_FILENO) == 1,
                                     &std::cin, isatty(STDIN_FILENO) == 1 ? STDIN_FILENO : -1};
  const int status = weft::daemon::cli::run(argc, argv, console);
  std::cout.flush();
  if (std::cout.good() || status != weft::daemon::cli::exit_ok) return status;
  std::cerr << "weft: standard output not written. Check that the disk is not full.\n";
  return weft::daemon::cli::exit_failure;
}

#include "experiments/cli/program.h"

int main(int argc, char** argv) { return restage::cli::run(argc, argv); }

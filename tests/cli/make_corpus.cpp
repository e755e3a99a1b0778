// make_corpus FILE.h5: bodies of one topology and motions for the tests of the command line (the
// built-in bodies have a mesh each).
#include <iostream>

#include "datasets/schema.h"
#include "tests/support/tiny_body.h"

int main(int argc, char** argv) try {
  if (argc != 2) throw std::runtime_error("usage: make_corpus FILE.h5");
  const restage::Corpus corpus = restage::testing::tiny_corpus();
  restage::write_dataset(argv[1], corpus.bodies, corpus.motions,
                         {corpus.license, corpus.description, ""});
  return 0;
} catch (const std::exception& error) {
  std::cerr << "make_corpus: " << error.what() << "\n";
  return 1;
}

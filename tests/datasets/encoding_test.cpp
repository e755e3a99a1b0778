// In which encoding names are: written out in bytes, as files have them.
#include "datasets/readers/text/encoding.h"

#include <gtest/gtest.h>

namespace restage::text {
namespace {

TEST(Encoding, LettersWithAccentsAreNoJapanese) {
  for (const std::vector<std::string>& names : {std::vector<std::string>{"T\xEAte"},  // Tête
                                                {"Hips", "\xC9paule_G", "T\xEAte"},   // Épaule
                                                {"H\xFC"
                                                 "fte",
                                                 "R\xFC"
                                                 "cken",
                                                 "Schl\xFCsselbein"},      // Hüfte, Rücken
                                                {"Fu\xDF.L", "Fu\xDF.R"},  // Fuß
                                                {"m\xE3o_esq", "p\xE9_esq", "bra\xE7o_esq",
                                                 "cabe\xE7"
                                                 "a"},  // mão, pé, braço
                                                {"clav\xED"
                                                 "cula",
                                                 "mu\xF1"
                                                 "eca",
                                                 "Rodilla", "Cabeza"}})  // clavícula, muñeca
    EXPECT_EQ(encoding_of(names), Encoding::latin1) << names[0];
}

TEST(Encoding, KanaAndKanjiAreJapanese) {
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{"\x93\xAA"},                      // 頭
        {"\x83\x5A\x83\x93\x83\x5E\x81\x5B"},                      // センター
        {"\x8D\xB6\x91\xAB", "\x89\x45\x82\xD0\x82\xB4", "Root"},  // 左足, 右ひざ
        {"\x8D\xB6\x91\xAB_IK", "\xCB\xAF\xCC\xDF"},               // half-width kana, too
        {"\xE4\x60_L", "\x8E\xF1"}})                               // a rare kanji beside 首
    EXPECT_EQ(encoding_of(names), Encoding::shift_jis) << names[0];
}

TEST(Encoding, WhatIsNotCertainIsNotSaid) {
  for (const std::vector<std::string>& names :
       {std::vector<std::string>{"\xCD\xB7", "\xD7\xF3\xCA\xD6"},  // GBK: 头, 左手
        {"\xB8\xD3\xB8\xAE"},                                      // EUC-KR: 머리
        {"\xC3\xEE\xEB\xEE\xE2\xE0"},                              // CP1251: Голова
        {"\x93\xAA", "T\xEAte"},                                   // two in one file
        {"\xFF"}})
    EXPECT_EQ(encoding_of(names), Encoding::unsure) << names[0];
  EXPECT_EQ(encoding_of({"Kopf", "Hüfte"}), Encoding::unsure);  // UTF-8 says nothing
}

}  // namespace
}  // namespace restage::text

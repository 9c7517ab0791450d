/* Runs a recorded run of a loop on a library of prebuilt kernels for aarch64: replay LIBRARY <RECORD >ARRAYS.
 *
 * The library is loaded by hand, since a static program has no loader of its own: segments, relocations, names. A record has whole
 * numbers: how many regions, pointers, kernels; the region that describes the loop; periods and lanes; bytes of each region;
 * (region, offset, kind, target, offset) of each pointer, kind 0 to a region, 1 to a kernel; then names of kernels, 32 bytes each,
 * of which the first is the loop's own; then the regions. Written are the regions as they are afterwards, and what was missed. */
#include <elf.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

static char *base;
static const Elf64_Sym *symbols;
static const char *names;
static size_t count;

static void *given(const char *name) {
  const struct {
    const char *name;
    void *place;
  } outside[] = {{"malloc", malloc}, {"free", free}, {"memset", memset}, {"memcpy", memcpy}, {"memmove", memmove}};
  for (size_t k = 0; k < sizeof outside / sizeof *outside; k++)
    if (!strcmp(name, outside[k].name)) return outside[k].place;
  fprintf(stderr, "the library asks for %s\n", name);
  exit(3);
}

static void *kernel(const char *name) {
  for (size_t k = 0; k < count; k++)
    if (symbols[k].st_shndx && !strcmp(names + symbols[k].st_name, name)) return base + symbols[k].st_value;
  fprintf(stderr, "the library has no %s\n", name);
  exit(4);
}

static void relocate(const Elf64_Rela *one) {
  const Elf64_Sym *symbol = symbols + ELF64_R_SYM(one->r_info);
  char **place = (char **)(base + one->r_offset);
  switch (ELF64_R_TYPE(one->r_info)) {
    case R_AARCH64_RELATIVE: *place = base + one->r_addend; return;
    case R_AARCH64_ABS64:
    case R_AARCH64_GLOB_DAT:
    case R_AARCH64_JUMP_SLOT:
      *place = (symbol->st_shndx ? base + symbol->st_value : (char *)given(names + symbol->st_name)) + one->r_addend;
      return;
    default: fprintf(stderr, "a relocation %d\n", (int)ELF64_R_TYPE(one->r_info)); exit(5);
  }
}

static void load(const char *path) {
  FILE *file = fopen(path, "rb");
  if (!file) exit(2);
  fseek(file, 0, SEEK_END);
  size_t size = (size_t)ftell(file), span = 0;
  char *content = malloc(size);
  rewind(file);
  if (fread(content, 1, size, file) != size) exit(2);
  fclose(file);
  const Elf64_Ehdr *head = (const Elf64_Ehdr *)content;
  const Elf64_Phdr *segment = (const Elf64_Phdr *)(content + head->e_phoff);
  for (int k = 0; k < head->e_phnum; k++)
    if (segment[k].p_type == PT_LOAD && span < segment[k].p_vaddr + segment[k].p_memsz) span = segment[k].p_vaddr + segment[k].p_memsz;
  base = mmap(NULL, span, PROT_READ | PROT_WRITE | PROT_EXEC, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (base == MAP_FAILED) exit(2);
  for (int k = 0; k < head->e_phnum; k++)
    if (segment[k].p_type == PT_LOAD) memcpy(base + segment[k].p_vaddr, content + segment[k].p_offset, segment[k].p_filesz);
  const Elf64_Shdr *section = (const Elf64_Shdr *)(content + head->e_shoff);
  for (int k = 0; k < head->e_shnum; k++)
    if (section[k].sh_type == SHT_DYNSYM) {
      symbols = (const Elf64_Sym *)(base + section[k].sh_addr);
      names = base + section[section[k].sh_link].sh_addr;
      count = section[k].sh_size / sizeof *symbols;
    }
  for (int k = 0; k < head->e_shnum; k++)
    if (section[k].sh_type == SHT_RELA)
      for (size_t at = 0; at < section[k].sh_size; at += sizeof(Elf64_Rela)) relocate((Elf64_Rela *)(base + section[k].sh_addr + at));
  __builtin___clear_cache(base, base + span);
}

static void read_all(void *place, size_t size) {
  if (fread(place, 1, size, stdin) != size) exit(6);
}

int main(int arguments, char **argument) {
  if (arguments != 2) return 2;
  load(argument[1]);
  enum { REGIONS, POINTERS, KERNELS, ABOUT, PERIODS, LANES, HEAD };
  int64_t head[HEAD];
  read_all(head, sizeof head);
  int64_t *sizes = malloc(8 * head[REGIONS]), (*pointers)[5] = malloc(40 * head[POINTERS]);
  char(*called)[32] = malloc(32 * head[KERNELS]), **regions = malloc(sizeof *regions * head[REGIONS]);
  read_all(sizes, 8 * head[REGIONS]);
  read_all(pointers, 40 * head[POINTERS]);
  read_all(called, 32 * head[KERNELS]);
  for (int64_t k = 0; k < head[REGIONS]; k++) {
    regions[k] = aligned_alloc(64, (sizes[k] + 127) / 64 * 64);
    read_all(regions[k], sizes[k]);
  }
  for (int64_t k = 0; k < head[POINTERS]; k++) {
    int64_t *one = pointers[k];
    char *target = one[2] ? kernel(called[one[3]]) : regions[one[3]] + one[4];
    memcpy(regions[one[0]] + one[1], &target, sizeof target);
  }
  int64_t (*run)(int64_t, int64_t, int64_t, int64_t) = (int64_t(*)(int64_t, int64_t, int64_t, int64_t))kernel(called[0]);
  int64_t missed = run((int64_t)regions[head[ABOUT]], head[PERIODS], 0, head[LANES]);
  for (int64_t k = 0; k < head[REGIONS]; k++) fwrite(regions[k], 1, sizes[k], stdout);
  fwrite(&missed, 1, sizeof missed, stdout);
  return 0;
}

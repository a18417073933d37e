!> The programs of the project. Each program reads the groups of a scene file that concern it.
module program_identity
   implicit none (type, external)
   private
   public :: program_name, program_version, name_of_program
   public :: program_motion, program_paper, program_benchmark, program_any, in_motion_and_benchmark

   !> Attribute `program` of the files that the programs write.
   character(*), parameter :: program_name = 'impactbeam'
   !> Version in the files that the programs write.
   character(*), parameter :: program_version = '0.1.0'

   ! The following constants are programs; each is a bit, so that a sum of constants stands for several programs.
   !> Program for runs, frequencies, sweeps and cases.
   integer, parameter :: program_motion = 1
   !> Program that judges the statements of the paper (Irie, Yamada and Asano 1977).
   integer, parameter :: program_paper = 2
   !> Benchmark of run time against error.
   integer, parameter :: program_benchmark = 4
   !> All programs.
   integer, parameter :: program_any = program_motion + program_paper + program_benchmark
   !> The first and the last of these programs.
   integer, parameter :: in_motion_and_benchmark = program_motion + program_benchmark

contains

   !> Command name of a program; of several programs, of the first.
   pure function name_of_program(program) result(name)
      !> One of the `program_` constants, or a sum of them
      integer, intent(in) :: program
      character(:), allocatable :: name

      name = program_name
      if (iand(program, program_motion) > 0) return
      name = name//trim(merge('-paper    ', '-benchmark', iand(program, program_paper) > 0))
   end function name_of_program

end module program_identity

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

   !> Programs as bits: motion (runs, frequencies, sweeps, cases), statements of the paper (Irie, Yamada and
   !> Asano 1977), benchmark of run time against error. A sum of constants stands for several programs.
   integer, parameter :: program_motion = 1
   integer, parameter :: program_paper = 2
   integer, parameter :: program_benchmark = 4
   integer, parameter :: program_any = program_motion + program_paper + program_benchmark
   integer, parameter :: in_motion_and_benchmark = program_motion + program_benchmark

contains

   !> Command name of a program; of several, the first one.
   pure function name_of_program(program) result(name)
      !> One of the `program_` constants, or a sum of them
      integer, intent(in) :: program
      character(:), allocatable :: name

      name = program_name
      if (iand(program, program_motion) > 0) return
      name = name//trim(merge('-paper    ', '-benchmark', iand(program, program_paper) > 0))
   end function name_of_program

end module program_identity

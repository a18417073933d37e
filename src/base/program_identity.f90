!> What the programs of this project call themselves in the files they write.
module program_identity
   implicit none (type, external)
   private
   public :: program_name, program_version

   !> Attribute `program` of their files
   character(*), parameter :: program_name = 'impactbeam'
   character(*), parameter :: program_version = '0.1.0'

end module program_identity

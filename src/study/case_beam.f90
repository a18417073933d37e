!> The beam of a case, with what its runs share, kept for the next case that has the same.
module case_beam
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use motion_run, only: find_shared_modes
   use scene_beam_model, only: motion_model_of, run_of
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: case_beam_t, find_case_beam

   type :: case_beam_t
      type(beam_model_t) :: model
      type(free_modes_t) :: modes
      !> Why it could not be made
      type(failure_t), allocatable :: trouble
      !> Values of the parameters for which it was made; unallocated: there is none
      real(wp), allocatable, private :: values(:)
   end type case_beam_t

contains

   !> Make the beam of a case, unless it is at hand.
   subroutine find_case_beam(scene, values, is_of_beam, beam)
      !> With the values of the case
      type(scene_t), intent(in) :: scene
      !> Of the parameters that differ from case to case, always the same ones
      real(wp), intent(in) :: values(:)
      !> Does another value make another beam?
      logical, intent(in) :: is_of_beam(:)
      type(case_beam_t), intent(inout) :: beam

      if (allocated(beam%values)) then
         if (all(abs(values - beam%values) <= 0.0_wp .or. .not. is_of_beam)) return
         deallocate (beam%values)
      end if
      allocate (beam%values, source=values)
      if (allocated(beam%trouble)) deallocate (beam%trouble)
      call motion_model_of(scene, scene%mesh%elements, scene%mesh%ratio, beam%model, beam%trouble)
      if (.not. allocated(beam%trouble)) call find_shared_modes(beam%model, run_of(scene), beam%modes, beam%trouble)
   end subroutine find_case_beam

end module case_beam

!> The beam of a case, with what its runs share, kept for the next case that has the same.
module case_beam
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use motion_run, only: find_shared_modes
   use response_types, only: mesh_check_t
   use run_settings, only: run_settings_t
   use scene_beam_model, only: motion_model_of, run_of
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: case_beam_t, make_case_beam

   type :: case_beam_t
      type(beam_model_t) :: model
      type(free_modes_t) :: modes
      !> How its mesh was found, if the scene asks for that
      type(mesh_check_t) :: check
      !> Why it could not be made
      type(failure_t), allocatable :: trouble
      !> Values of the parameters for which it was made; unallocated: there is none
      real(wp), allocatable :: values(:)
   end type case_beam_t

contains

   !> Make the beam of a scene on a mesh.
   subroutine make_case_beam(scene, elements, ratio, beam, settings)
      type(scene_t), intent(in) :: scene
      integer, intent(in) :: elements
      !> Length of an element over that of the next towards the tip
      real(wp), intent(in) :: ratio
      type(case_beam_t), intent(out) :: beam
      !> Of its runs, where they are not the scene's
      type(run_settings_t), intent(in), optional :: settings

      call motion_model_of(scene, elements, ratio, beam%model, beam%trouble)
      if (allocated(beam%trouble)) return
      if (present(settings)) then
         call find_shared_modes(beam%model, settings, beam%modes, beam%trouble)
      else
         call find_shared_modes(beam%model, run_of(scene), beam%modes, beam%trouble)
      end if
   end subroutine make_case_beam

end module case_beam

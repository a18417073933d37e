!> What is computed from a finished run, or from a beam alone: a group of the results file, lines on the console, and
!> measures of the run. The table of all is in `analyses`.
module analysis_types
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use kinds, only: wp
   use quantities, only: units_t
   use quantity_groups, only: quantity_group_t
   use response_types, only: response_t
   use run_settings, only: run_settings_t
   use scene_types, only: scene_t
   implicit none (type, external)
   private
   public :: analysis_t

   !> Extensions hold what was found.
   type, abstract :: analysis_t
   contains
      procedure(compute_interface), deferred :: compute
      procedure(write_interface), deferred :: write
      procedure :: print => print_nothing
      procedure :: fill => fill_nothing
   end type analysis_t

   abstract interface
      !> Find what the scene asks for.
      subroutine compute_interface(self, scene, model, settings, response, error)
         import :: analysis_t, beam_model_t, failure_t, response_t, run_settings_t, scene_t
         implicit none (type, external)
         class(analysis_t), intent(inout) :: self
         !> It has the settings of the analysis
         type(scene_t), intent(in) :: scene
         !> The beam, and the run of it that the scene describes
         type(beam_model_t), intent(in) :: model
         type(run_settings_t), intent(in) :: settings
         !> Of that run; nothing is in it where a beam alone is analysed
         type(response_t), intent(in) :: response
         !> Set when nothing is found
         type(failure_t), allocatable, intent(out) :: error
      end subroutine compute_interface

      !> Write its group.
      subroutine write_interface(self, group)
         import :: analysis_t, quantity_group_t
         implicit none (type, external)
         class(analysis_t), intent(in) :: self
         !> Empty
         type(quantity_group_t), intent(in) :: group
      end subroutine write_interface
   end interface

contains

   !> Lines on the console; an analysis that has some overrides it.
   subroutine print_nothing(self, unit, units)
      class(analysis_t), intent(in) :: self
      integer, intent(in) :: unit
      !> What results are in
      type(units_t), intent(in) :: units

      associate (unused_1 => self, unused_2 => unit, unused_3 => units)
      end associate
   end subroutine print_nothing

   !> Measures of the run; an analysis that has some overrides it.
   subroutine fill_nothing(self, row)
      class(analysis_t), intent(in) :: self
      !> Dimensionless, [measure_count]
      real(wp), intent(inout) :: row(:)

      associate (unused_1 => self, unused_2 => row)
      end associate
   end subroutine fill_nothing

end module analysis_types

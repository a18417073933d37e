!> The beam with its stops open under harmonic loads, in closed form from its modes (docs/theory.md, section 21).
module frequency_response
   use applied_loads, only: applied_loads_t, count_forces, courses_of, gather_loads
   use beam_model, only: beam_model_t
   use failures, only: failure_t
   use few_modes, only: find_modes_of_run
   use free_modes, only: free_modes_t
   use kinds, only: wp
   use load_settings, only: base_displacement, course_harmonic, time_course_t
   use mode_choice, only: rates_of_modes
   use response_types, only: frequency_response_t
   use run_settings, only: frequency_response_settings_t, run_settings_t
   use stop_surfaces, only: surface_t, surfaces_of
   implicit none (type, external)
   private
   public :: find_frequency_response

contains

   !> All harmonic loads at one frequency after the other, each with its amplitude and phase.
   subroutine find_frequency_response(model, settings, asked, answer, error)
      type(beam_model_t), intent(in) :: model
      !> Loads, stops, damping
      type(run_settings_t), intent(in) :: settings
      type(frequency_response_settings_t), intent(in) :: asked
      type(frequency_response_t), intent(out) :: answer
      !> Set when the modes cannot be found
      type(failure_t), allocatable, intent(out) :: error

      type(free_modes_t) :: modes
      type(applied_loads_t) :: loads
      type(surface_t), allocatable :: surfaces(:)
      real(wp), allocatable :: damping(:), force(:, :)
      complex(wp), allocatable :: coordinate(:)
      integer :: i, k, kept

      call find_modes_of_run(model, settings, modes, error)
      if (allocated(error)) return
      kept = size(modes%square)
      if (settings%response%mode_count > 0) kept = min(kept, settings%response%mode_count)
      allocate (surfaces, source=surfaces_of(settings))
      call gather_loads(model, settings, loads)
      force = matmul(transpose(modes%mode(:, :kept)), loads%vector)
      damping = 2.0_wp*settings%zeta*modes%square(:kept) + rates_of_modes(settings, modes%square(:kept))
      answer%frequency = frequencies_of(asked)
      allocate (answer%tip(asked%points), answer%stop(size(surfaces), asked%points))
      do i = 1, asked%points
         associate (omega => answer%frequency(i))
            coordinate = matmul(force, amplitudes_at(settings, omega))/cmplx(modes%square(:kept) - omega**2, &
               omega*damping, wp)
         end associate
         answer%tip(i) = sum(modes%mode(modes%tip_dof, :kept)*coordinate)
         do k = 1, size(surfaces)
            associate (dof => model%stop_dofs(surfaces(k)%stop))
               answer%stop(surfaces(k)%number, i) = sum(modes%mode(dof, :kept)*coordinate)
            end associate
         end do
      end do
   end subroutine find_frequency_response

   !> Divided evenly, the ends exact.
   pure function frequencies_of(asked) result(frequency)
      type(frequency_response_settings_t), intent(in) :: asked
      real(wp) :: frequency(asked%points)

      integer :: i

      associate (least => asked%range(1), most => asked%range(2), last => real(asked%points - 1, wp))
         if (asked%is_logarithmic) then
            frequency = [(least*(most/least)**(real(i, wp)/last), i=0, asked%points - 1)]
         else
            frequency = [(least + (most - least)*(real(i, wp)/last), i=0, asked%points - 1)]
         end if
         frequency(asked%points) = most
      end associate
   end function frequencies_of

   !> Of all loads in the order of `gather_loads`; what is not harmonic has none.
   pure function amplitudes_at(settings, omega) result(amplitude)
      type(run_settings_t), intent(in) :: settings
      real(wp), intent(in) :: omega
      complex(wp), allocatable :: amplitude(:)

      type(time_course_t), allocatable :: courses(:)
      integer :: forces, k

      allocate (courses, source=courses_of(settings))
      ! over exp(i omega tau), of which the imaginary part is meant
      amplitude = merge(cmplx(courses%amplitude*cos(courses%phase), courses%amplitude*sin(courses%phase), wp), &
         (0.0_wp, 0.0_wp), courses%kind == course_harmonic)
      forces = count_forces(settings)
      do k = forces + 1, size(courses)
         if (settings%bases(k - forces)%quantity == base_displacement) amplitude(k) = -omega**2*amplitude(k)
      end do
   end function amplitudes_at

end module frequency_response
